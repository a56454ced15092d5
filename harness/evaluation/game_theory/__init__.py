"""How near a campaign's players are to an equilibrium: pure functions from tables of games to tables of findings."""
