"""What a person reads of a run: CSV tables and the HTML page."""
