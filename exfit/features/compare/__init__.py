"""Two responses beside each other, whichever program each is from: exfit compare."""
