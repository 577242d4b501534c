"""The colours of all figures."""

# Told apart by people with any colour vision: Okabe and Ito, "Color universal design", 2008.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
SHELF = "#c9c4bb"
FLOOR = "#f7f5f1"
TRUTH = "#222222"
