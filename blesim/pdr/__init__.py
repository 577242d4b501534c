"""Dead reckoning from the phone's own sensors: step detectors, building blocks of estimators."""
