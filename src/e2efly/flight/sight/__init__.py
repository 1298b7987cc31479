"""Images for a policy that sees: where they come from, and whether they can be trusted. Imports no JAX."""
