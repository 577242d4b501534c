"""What the phone feels while it is carried."""
