"""The game itself, in NumPy alone, over arrays with a leading axis G (games) and P (players)."""
