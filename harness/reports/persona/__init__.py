"""A persona's portrait: what its document means, as numbers, words and curves, in the terminal and as a page."""
