"""A campaign from its document to its report: checked, planned, carried out, stored, evaluated."""
