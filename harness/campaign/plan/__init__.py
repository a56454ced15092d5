"""Which trainings, searches and arms follow from a campaign document."""
