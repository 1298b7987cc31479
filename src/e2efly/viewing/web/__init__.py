"""A policy that flies in a browser: what `e2efly export RUN --web DIR` writes. Its sources are in `web/`."""
