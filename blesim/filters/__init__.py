"""Kalman and particle machinery: building blocks of estimators."""
