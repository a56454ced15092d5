"""Game theory of a campaign: pure functions from tables of games to tables of gaps, cross-play and equilibria."""
