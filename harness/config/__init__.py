"""The documents that users write (campaigns, scenes, personas and drivers) as validated, frozen records."""
