"""How severe a recorded game is: the contact, and how close it came without one."""
