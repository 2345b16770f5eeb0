"""The report of a track."""
