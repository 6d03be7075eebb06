"""PSLF dynamics files (.dyd): their lines."""
