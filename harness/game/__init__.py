"""The game: state, dynamics, road, observations and payoffs, in NumPy and compiled loops over arrays [G, P].

G is the number of games, P the number of players.
"""
