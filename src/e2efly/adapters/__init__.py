"""The environment with the interfaces of other frameworks. Each module needs an extra of the package."""
