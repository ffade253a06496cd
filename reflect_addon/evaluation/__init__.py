"""How wrong, how fast: truth, metrics, rows, results.json and the HTML report."""
