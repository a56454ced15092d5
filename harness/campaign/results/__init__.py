"""From a run folder to tables, model cards, replays and the report."""
