"""What the phone hears: from the advertising event to the reading an application gets."""
