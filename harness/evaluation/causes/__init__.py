"""Why the ego failed: the cause of each failure by stated rules, and of many failures in one sentence."""
