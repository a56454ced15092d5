"""The road users of route files: types, routes, flows, departures and the warm-up."""
