"""The profile of a persona: its document in numbers, sentences and curves, in the terminal and as a page."""
