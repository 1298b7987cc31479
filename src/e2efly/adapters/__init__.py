"""The environment in the clothes of other frameworks; each module needs the extra of its name."""
