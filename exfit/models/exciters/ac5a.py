"""AC5A: simplified brushless exciter (IEEE Std 421.5-2005, 6.5).

            vsum       VRMAX                            VE >= 0
              ▼
vref + vs ──►(+)─►(+)─►[  KA  ]────────────┬─ VR ─►(+)─►[  1  ]─┬─► VE = efd
           -▲    -▲    [1+sTA]             │       -▲   [ sTE ] │
            │     │    VRMIN               │        └─── VFE ◄──┘
vc1 ►[  1  ]┘     │                        │
     [1+sTR]      └─[  sKF   ]◄─[1 + sTF3]◄┘
                    [1 + sTF1]  [1 + sTF2]

VFE = KE VE + VX(VE): the curve is that of the loaded exciter; there is neither
a rectifier nor a field current. The limits of the lag and of VE are non-windup.
The feedback is taken from VR, as the models written after PSS/E's ESAC5A do:
efd of a brushless machine cannot be measured, and 1/(1 + sTF2) stands for the
exciter. TF2 = 0 bypasses TF3 with it. TA > 0: the loop needs a lag.

UEL and OEL are added to vs. Not modelled: PSS/E's own choice of KE or VRMAX
where a record says 0. Copies of the sample data differ in TF2, TF3: 0.8
and 0 here, 1 and 1 (which cancel) elsewhere.
"""

from exfit.models.blocks import Signal, exciter, exciter_demand, lag, lead_lag, limited_lag, washout
from exfit.models.sheet import LAG_OF_KF, OF_A_LIST, REGULATOR_LAG, TIME, record, shared, sheet

ALIASES = ("ESAC5A",)

SHEET = sheet(
    *shared(TR=0.0, KA=400.0),
    ("TA", 0.02, "s", (0.001, 10.0), "regulator time constant", REGULATOR_LAG),
    *shared(VRMAX=7.3, VRMIN=-7.3),
    ("KE", 1.0, "pu", (0.001, 10.0), "exciter constant"),
    *shared(TE=0.8, KF=0.03, TF1=1.0),
    ("TF2", 0.8, *TIME, "stabilising feedback lag", LAG_OF_KF),
    ("TF3", 0.0, *TIME, "stabilising feedback lead"),
    *shared(E1=5.6, SE1=0.86, E2=4.2, SE2=0.5),
)

RECORDS = (record("ESAC5A", "TR KA TA VRMAX VRMIN KE TE KF TF1 TF2 TF3 E1 SE1 E2 SE2"),)

PSLF_RECORDS = (
    record(
        "esac5a",
        "TR KA TA VRMAX VRMIN KE TE KF TF1 TF2 TF3 E1 SE1 E2 SE2 SPDMLT",
        ignored="SPDMLT",
        doubt=OF_A_LIST,
    ),
)

STATES = "VC VR VE VL VF"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vl, d.VL = lead_lag(s.VR, s.VL, p.TF3, p.TF2)
    vf, d.VF = washout(vl, s.VF, p.KF, p.TF1)
    vr, d.VR = limited_lag(u.vref + u.vs + u.vsum - vc - vf, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    efd, d.VE = exciter(vr, s.VE, p.KE, p, low=0.0)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vfe = exciter_demand(efd, p.KE, p)
    x.VC, x.VR, x.VE, x.VL, x.VF = u.vc1, vfe, efd, vfe, vfe
    return u.vc1 + vfe / p.KA - u.vs
