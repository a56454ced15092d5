"""Opening a scene: its document, net and routes, checked against one another."""
