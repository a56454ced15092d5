"""The game itself, in NumPy and compiled loops, over arrays with a leading axis G (games) and P (players)."""
