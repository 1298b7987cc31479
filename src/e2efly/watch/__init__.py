"""Flights in a browser, live: `e2efly watch`. A source gives frames, the viewer shows them (viser, https://viser.studio).

`frames` says what a frame is, `shapes` what things look like; `simulation`, `training` and `recording` are sources;
`viewer` and `panels` are the page; `film` draws the same without a browser.
"""
