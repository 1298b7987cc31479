"""Images for a policy that sees: where they come from, and whether they can be believed. Imports no JAX."""
