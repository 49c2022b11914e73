"""The live board: a scenario as sliders in the browser, flown again at each change."""
