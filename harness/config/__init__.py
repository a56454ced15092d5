"""What a person writes: campaigns, scenes and personas, as validated, frozen records."""
