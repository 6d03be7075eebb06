"""The turbine governors."""

FAMILIES = {  # files that hold several models; any other is named after its own
    "steam": "IEEEG1 IEESGO TGOV1",
    "gas": "GAST GGOV1",
    "rowen": "GAST2A GASTWD",
    "hydro": "HYGOV2 IEEEG2 IEEEG3 PIDGOV WPIDHY",
    "hydro_nonlinear": "HYG3 HYGOVR",
}
