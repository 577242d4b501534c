"""Who walks: scripted testers, shoppers and staff as SimPy processes, and their exact walks."""
