"""Rates that are assumed where nothing says them; help texts load no more than this."""

ASSUMED_HZ = 30.0  # observations a second where the capture knows neither times nor a rate
