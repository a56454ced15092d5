"""Carrying a plan out: worker processes, retries after crashes, caching, progress."""
