"""Live flights in a browser: `e2efly watch`. A source provides frames, the viewer shows them (viser, https://viser.studio).

`frames` defines a frame, and `shapes` the shapes that are drawn. `simulation`, `training` and `recording` are sources.
`viewer` and `panels` are the page. `film` draws the same without a browser.
"""
