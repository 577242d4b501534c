"""Tables and figures for people; the only room that draws."""
