"""One thin operator per file: poll, gather settings, call one function, report."""
