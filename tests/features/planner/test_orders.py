"""Orders of records, typed from their sources: each value goes where the source has its name."""

import pytest

from exfit.features.planner.export import Written, warnings_of
from exfit.features.planner.pslf import heads
from exfit.features.planner.psse import sound_records
from exfit.features.planner.records import (
    PSLF,
    PSSE,
    Definition,
    definitions,
    read_values,
    record_fields,
)
from exfit.models import LIMITERS
from exfit.models.sheet import typical
from exfit.util.text import show

# OPAL-RT's ePHASORSIM Modelica library (cba975b8): a model's parameters in the order of PSS/E's
# constants, its integers apart, which are those of InterPSS
OPAL_RT = """
GENROU Tpd0 Tppd0 Tpq0 Tppq0 H D Xd Xq Xpd Xpq Xppd Xl S10 S12
GENROE Tpd0 Tppd0 Tpq0 Tppq0 H D Xd Xq Xpd Xpq Xppd Xl S10 S12
GENTPJ1 Tpd0 Tppd0 Tpq0 Tppq0 H D Xd Xq Xpd Xpq Xppd Xppq Xl S10 S12 Kis
GENSAL Tpd0 Tppd0 Tppq0 H D Xd Xq Xpd Xppd Xl S10 S12
GENSAE Tpd0 Tppd0 Tppq0 H D Xd Xq Xpd Xppd Xl S10 S12
AC7B TR KPR KIR KDR TDR VRMAX VRMIN KPA KIA VAMAX VAMIN KP KL KF1 KF2 KF3 TF KC KD KE TE VFEMAX
     VEMIN E1 SE1 E2 SE2
AC8B TR KPR KIR KDR TDR VPIDMAX VPIDMIN KA TA VRMAX VRMIN KC KD KE TE VFEMAX VEMIN E1 SE1 E2 SE2
ESAC1A TR TB TC KA TA VAMAX VAMIN TE KF TF KC KD KE E1 SE1 E2 SE2 VRMAX VRMIN
ESAC2A TR TB TC KA TA VAMAX VAMIN KB VRMAX VRMIN TE VFEMAX KH KF TF KC KD KE E1 SE1 E2 SE2
ESAC3A TR TB TC KA TA VAMAX VAMIN TE VEMIN KR KF TF KN EFDN KC KD KE VFEMAX E1 SE1 E2 SE2
ESAC5A TR KA TA VRMAX VRMIN KE TE KF TF1 TF2 TF3 E1 SE1 E2 SE2
ESAC6A TR KA TA TK TB TC VAMAX VAMIN VRMAX VRMIN TE VFELIM KH VHMAX TH TJ KC KD KE E1 SE1 E2 SE2
ESDC1A TR KA TA TB TC VRMAX VRMIN KE TE KF TF Switch E1 SE1 E2 SE2
ESDC2A TR KA TA TB TC VRMAX VRMIN KE TE KF TF Switch E1 SE1 E2 SE2
ESST1A UEL VOS TR VIMAX VIMIN TC TB TC1 TB1 KA TA VAMAX VAMIN VRMAX VRMIN KC KF TF KLR ILR
ESST3A TR VIMAX VIMIN KM TC TB KA TA VRMAX VRMIN KG KP KI VBMAX KC XL VGMAX THETAP TM VMMAX VMMIN
ESST4B TR KPR KIR VRMAX VRMIN TA KPM KIM VMMAX VMMIN KG KP KI VBMAX KC XL THETAP
EXAC1 TR TB TC KA TA VRMAX VRMIN TE KF TF KC KD KE E1 SE1 E2 SE2
EXAC1A TR TB TC KA TA VRMAX VRMIN TE KF TF KC KD KE E1 SE1 E2 SE2
EXAC2 TR TB TC KA TA VAMAX VAMIN KB VRMAX VRMIN TE KL KH KF TF KC KD KE VLR E1 SE1 E2 SE2
EXAC3 TR TB TC KA TA VAMAX VAMIN TE KLV KR KF TF KN EFDN KC KD KE VLV E1 SE1 E2 SE2
EXAC4 TR VIMAX VIMIN TC TB KA TA VRMAX VRMIN KC
EXDC1 TR KA TA TB TC VRMAX VRMIN KE TE KF TF1 Switch E1 SE1 E2 SE2
EXDC2 TR KA TA TB TC VRMAX VRMIN KE TE KF TF1 Switch E1 SE1 E2 SE2
EXPIC1 TR KA TA1 VR1 VR2 TA2 TA3 TA4 VRMAX VRMIN KF TF1 TF2 EFDMAX EFDMIN KE TE E1 SE1 E2 SE2
       KP KI KC
EXST1 TR VIMAX VIMIN TC TB KA TA VRMAX VRMIN KC KF TF
EXST2 TR KA TA VRMAX VRMIN KE TE KF TF KP KI KC EFDMAX
EXST3 TR VIMAX VIMIN KJ TC TB KA TA VRMAX VRMIN KG KP KI EFDMAX KC XL VGMAX THETAP
IEEET1 TR KA TA VRMAX VRMIN KE TE KF TF Switch E1 SE1 E2 SE2
IEEET2 TR KA TA VRMAX VRMIN KE TE KF TF1 TF2 E1 SE1 E2 SE2
IEEET3 TR KA TA VRMAX VRMIN TE KF TF KP KI VBMAX KE
IEEEX1 TR KA TA TB TC VRMAX VRMIN KE TE KF TF1 Switch E1 SE1 E2 SE2
REXSYS TR KVP KVI VIMAX TA TB1 TC1 TB2 TC2 VRMAX VRMIN KF TF TF1 TF2 FBF KIP KII TP VFMAX VFMIN
       KH KE TE KC KD E1 SE1 E2 SE2 FLIMF
SCRX TATB TB K TE EMIN EMAX CSWITCH RCRFD
SEXS TATB TB K TE EMIN EMAX
ST5B TR TC1 TB1 TC2 TB2 KR VRMAX VRMIN T1 KC TUC1 TUB1 TUC2 TUB2 TOC1 TOB1 TOC2 TOB2
ST6B OEL TR KPA KIA KDA TDA VAMAX VAMIN KFF KM KCI KLR ILR VRMAX VRMIN KG TG
ST7B OEL UEL TR TG TF VMAX VMIN KPA VRMAX VRMIN KH KL TC TB KIA TIA
IEEEST ICS REMBUS A1 A2 A3 A4 A5 A6 T1 T2 T3 T4 T5 T6 KS LSMAX LSMIN VCU VCL
PSS2A ICS1 REMBUS1 ICS2 REMBUS2 M N TW1 TW2 T6 TW3 TW4 T7 KS2 KS3 T8 T9 KS1 T1 T2 T3 T4
      VSTMAX VSTMIN
PSS3B ICS1 REMBUS1 ICS2 REMBUS2 KS1 T1 TW1 KS2 T2 TW2 TW3 A1 A2 A3 A4 A5 A6 A7 A8 VSTMAX VSTMIN
ST2CUT ICS1 REMBUS1 ICS2 REMBUS2 K1 K2 T1 T2 T3 T4 T5 T6 T7 T8 T9 T10 LSMAX LSMIN VCU VCL
STAB1 K_T T T1_T3 T3 T2_T4 T4 HLIM
GAST R T1 T2 T3 AT KT VMAX VMIN Dturb
GGOV1 Rselect Flag R Tpelec maxerr minerr Kpgov Kigov Kdgov Tdgov VMAX VMIN Tact Kturb Wfnl Tb Tc
      Teng Tfload Kpload Kiload Ldref Dm Ropen Rclose Kimw Aset Ka Ta Trate db Tsa Tsb Rup Rdown
DEGOV1 M T1 T2 T3 K T4 T5 T6 TD TMAX TMIN DROOP TE
GAST2A W X Y Z ETD TCD Trate T MAX MIN ECR K3 A B C TAUF KF K5 K4 T3 T4 TAUT T5 AF1 BF1 AF2 BF2 CF2
       TR K6 TC
HYGOV R r Tr Tf Tg VELM GMAX GMIN TW At Dturb qNL
IEEEG1 JBUS M K T1 T2 T3 UO UC PMAX PMIN T4 K1 K2 T5 K3 K4 T6 K5 K6 T7 K7 K8
IEESGO T1 T2 T3 T4 T5 T6 K1 K2 K3 PMAX PMIN
TGOV1 R T1 VMAX VMIN T2 T3 Dt
TGOV3 K T1 T2 T3 UO UC PMAX PMIN T4 K1 T5 K2 T6 K3 TA TB TC PRMAX
WESGOV DTC DTP DROOP KP TI T1 T2 ALIM TPE
WSIEG1 JBUS M K T1 T2 T3 UO UC PMAX PMIN T4 K1 K2 T5 K3 K4 T6 K5 K6 T7 K7 K8 DB1 EPS DB2 GV1 PGV1
       GV2 PGV2 GV3 PGV3 GV4 PGV4 GV5 PGV5 IBLOCK
LCFB1 Fbf Pbf Fb Tpelec db emax Kp Ki Irmax
UEL1 KUR KUC KUF VURMAX VUCMAX KUI KUL VUIMAX VUIMIN TU1 TU2 TU3 TU4 VULMAX VULMIN
"""
# its ESAC8B is Basler's, and may be read as another model's
AS_ESAC8B = "TR KP KI KD TD KA TA VRMAX VRMIN TE KE E1 SE1 E2 SE2"
# OpenIPSL (2be0558a): its parameters in the order of PSS/E's constants where OPAL-RT has another
# order (PSS2B, URST5T) or no model
OPENIPSL = """
PSS2B ICS1 REMBUS1 ICS2 REMBUS2 M N TW1 TW2 T6 TW3 TW4 T7 KS2 KS3 T8 T9 KS1 T1 T2 T3 T4 T10 T11
      VSI1MAX VSI1MIN VSI2MAX VSI2MIN VSTMAX VSTMIN
URST5T TR TC1 TB1 TC2 TB2 KR VRMAX VRMIN T1 KC
STAB2A K2 T2 K3 T3 K4 K5 T5 HLIM
"""
# InterPSS's reader of .dyr files and its files (InterPSS-Project/ipss-plugin at f1d1f27d); PSS/E
# 36.7 ran BBSEX1, EXELI, IEEET4, IEEEX2, ST1C, ST10C, PSS2C, PSS3C, PSS6C, PSS7C, GENTRA so, and
# AC8CU1, DC4CU1, ST4CU1, UEL2CU1
INTERPSS = """
UEL2CU1 K1 K2 QUADRANT SW1 TUV TUP TUQ KUI KUL VUIMAX VUIMIN KUF KFB TUL TU1 TU2 TU3 TU4 P0 Q0 P1
        Q1 P2 Q2 P3 Q3 P4 Q4 P5 Q5 P6 Q6 P7 Q7 P8 Q8 P9 Q9 P10 Q10 VULMAX VULMIN VBIAS KFIX TADJ
        TQREF VUELMAX2 VUELMIN2 VUELMAX1 VUELMIN1 XQ
GENQECU SATFLG Tpd0 Tppd0 Tpq0 Tppq0 H D Xd Xq Xpd Xpq Xppd Xppq Xl S10 S12 Kw
GENQEJU SATFLG Tpd0 Tppd0 Tpq0 Tppq0 H D Xd Xq Xpd Xpq Xppd Xppq Xl S10 S12 Kis
H6EU1 Fd Re Rg Tpe Tsp Kp Ki Kd Td Velm GMAX GMIN Buf Buv Kg Tg BLG DBBD Tbd BLB DBBS Tbs Bgvmin Blv
      Dturb Pgc Deff Hdam Tw GV1 GV2 GV3 GV4 GV5 GV6 GV7 GV8 GV9 GV10 PGV1 PGV2 PGV3 PGV4 PGV5 PGV6
      PGV7 PGV8 PGV9 PGV10 BGV1 BGV2 BGV3 BGV4 BGV5 BGV6 BGV7 BGV8 BGV9 BGV10 Sprate DB1 EPS Trate
PIDGOV Feedback Rperm Treg Kp Ki Kd Ta Tb Dturb G0 G1 P1 G2 P2 P3 GMAX GMIN Atw Tw VELMAX VELMIN
GENTRA Tpd0 H D Xd Xq Xpd S10 S12 AF
AC8CU1 OEL UEL SCL VOS SW1 TR KPR KIR KDR TDR VPIDMAX VPIDMIN KA TA VRMAX VRMIN KC KD KE TE VFEMAX
       VEMIN E1 SE1 E2 SE2 KP KI XL THETAP KC1 VBMAX
DC4CU1 OEL UEL SCL SW1 TR KPR KIR KDR TDR VRMAX VRMIN KA TA KE TE KF TF VEMIN E1 SE1 E2 SE2 KP KI
       XL THETAP KC1 VBMAX
ST4CU1 VOS OEL UEL SCL SW1 TR KPR KIR VRMAX VRMIN KPM KIM VMMAX VMMIN TA VAMAX VAMIN KG TG VGMAX KP
       KI XL THETAP KC VBMAX
IEEEX2 TR KA TA TB TC VRMAX VRMIN KE TE KF TF1 TF2 E1 SE1 E2 SE2
BBSEX1 TR K T1 T2 T3 T4 VRMAX VRMIN EFDMAX EFDMIN SWITCH
ESAC4A TR VIMAX VIMIN TC TB KA TA VRMAX VRMIN KC
DC3A TR KV VRMAX VRMIN TRH TE KE VEMIN E1 SE1 E2 SE2
IEEET4 KR TRH KV VRMAX VRMIN TE KE E1 SE1 E2 SE2
EXDC2A TR KA TA TB TC VRMAX VRMIN KE TE KF TF1 TF2 E1 SE1 E2 SE2
EXELI TFV TFI TNU VPU VPI VPNF DPNF EFMIN EFMAX XE TW KS1 KS2 TS1 TS2 SMAX
DC4B OEL UEL TR KP KI KD TD VRMAX VRMIN KA TA KE TE KF TF VEMIN E1 SE1 E2 SE2
ESST2A TR KA TA VRMAX VRMIN KE TE KF TF KP KI KC EFDMAX
EXST2A TR KA TA VRMAX VRMIN KE TE KF TF KP KI KC EFDMAX
AC1C OEL UEL TR TB TC KA TA VAMAX VAMIN TE KF TF KC KD KE E1 SE1 E2 SE2 EFEMAX EFEMIN VFEMAX
     VEMIN
AC2C OEL UEL TR TB TC KA TA VAMAX VAMIN KB EFEMAX EFEMIN TE VFEMAX KH KF TF KC KD KE E1 SE1 E2
     SE2 VEMIN
AC3C OEL UEL TR TB TC KA TA VAMAX VAMIN TE VEMIN KR KF TF KN EFDN KC KD KE VFEMAX E1 SE1 E2 SE2
     KPR KIR KDR TDR VPIDMAX VPIDMIN
AC4C OEL UEL TR VIMAX VIMIN TC TB KA TA VRMAX VRMIN KC
AC5C OEL UEL TR KA TA VAMAX VAMIN KE TE KF TF1 TF2 TF3 E1 SE1 E2 SE2 KC KD VFEMAX VEMIN
AC6C OEL UEL TR KA TA TK TB TC VAMAX VAMIN EFEMAX EFEMIN TE VFELIM KH VHMAX TH TJ KC KD KE
     E1 SE1 E2 SE2 VFEMAX VEMIN
AC7C OEL UEL VOS SW1 SW2 TR KPR KIR KDR TDR VRMAX VRMIN KPA KIA VAMAX VAMIN KP KL KF1 KF2 KF3 TF
     KC KD KE TE VFEMAX VEMIN E1 SE1 E2 SE2 KI XL THETAP KC1 VBMAX KR
AC8C OEL UEL VOS SW1 TR KPR KIR KDR TDR VPIDMAX VPIDMIN KA TA VRMAX VRMIN KC KD KE TE VFEMAX VEMIN
     E1 SE1 E2 SE2 KP KI XL THETAP KC1 VBMAX
AC9C OEL UEL SW1 TR KPR KIR KDR TDR VPIDMAX VPIDMIN KPA KIA VAMAX VAMIN KA TA VRMAX VRMIN KF TF KFW
     VFWMAX VFWMIN SCT KC KD KE TE VFEMAX VEMIN E1 SE1 E2 SE2 KP KI1 KI2 KC1 KC2 XL THETAP VBMAX1
     VBMAX2 VLIM1 VLIM2
AC11C OEL UEL VOS SW1 TR KPA TIA KPU TIU KB TB KPO TIO VRSMAX VRSMIN VRMAX VRMIN VAMAX VAMIN TE KC
      KD KE VFEMAX VEMIN E1 SE1 E2 SE2 KP KI XL THETAP KC1 VBMAX1 KI2 KC2 VBMAX2 KBOOST VBOOST
ST10C VOS OEL UEL SCL SW1 TR KR TC1 TB1 TC2 TB2 TUC1 TUB1 TUC2 TUB2 TOC1 TOB1 TOC2 TOB2 VRSMAX
      VRSMIN VRMAX VRMIN T1 KP KC KI XL THETAP VBMAX
ST1C UEL VOS OEL TR VIMAX VIMIN TC TB TC1 TB1 KA TA VAMAX VAMIN VRMAX VRMIN KC KF TF KLR ILR
PSS1A ICS REMBUS A1 A2 T1 T2 T3 T4 T5 T6 KS VSTMAX VSTMIN VCU VCL
PSS2C ICS1 REMBUS1 ICS2 REMBUS2 M N TW1 TW2 T6 TW3 TW4 T7 KS2 KS3 T8 T9 KS1 T1 T2 T3 T4 T10 T11
      VSI1MAX VSI1MIN VSI2MAX VSI2MIN VSTMAX VSTMIN T12 T13 PPSSON PPSSOFF XCOMP TCOMP
PSS3C ICS1 REMBUS1 ICS2 REMBUS2 KS1 T1 TW1 KS2 T2 TW2 TW3 A1 A2 A3 A4 A5 A6 A7 A8 VSTMAX VSTMIN
      PPSSON PPSSOFF XCOMP TCOMP TPGFILT
PSS6C ICS1 REMBUS1 ICS2 REMBUS2 T1 KS2 T2 KS1 T3 MACC T4 TD K0 K1 K2 K3 K4 TI1 TI2 KI3 TI3 KI4 TI4
      KS VSI1MAX VSI1MIN VSI2MAX VSI2MIN VSTMAX VSTMIN PPSSON PPSSOFF XCOMP TCOMP
PSS7C ICS1 REMBUS1 ICS2 REMBUS2 M N TW1 TW2 T6 TW3 TW4 T7 KS2 KS3 T8 T9 KS1 K0 K1 K2 K3 K4 TI1
      TI2 KI3 TI3 KI4 TI4 VSI1MAX VSI1MIN VSI2MAX VSI2MIN VSTMAX VSTMIN PPSSON PPSSOFF XCOMP TCOMP
"""
# governors as InterPSS reads them, which PowerWorld 24 ran so, IEEEG1D PSS/E 36.7
OF_POWERWORLD = """
TGOV1D R T1 VMAX VMIN T2 T3 Dt DBH DBL Trate
IEEEG1D JBUS M K T1 T2 T3 UO UC PMAX PMIN T4 K1 K2 T5 K3 K4 T6 K5 K6 T7 K7 K8 DBH DBL Trate
IEESGOD T1 T2 T3 T4 T5 T6 K1 K2 K3 PMAX PMIN DBH DBL Trate
GASTD R T1 T2 T3 AT KT VMAX VMIN Dturb DBH DBL Trate
GGOV1D Rselect Flag R Tpelec maxerr minerr Kpgov Kigov Kdgov Tdgov VMAX VMIN Tact Kturb Wfnl Tb Tc
       Teng Tfload Kpload Kiload Ldref Dm Ropen Rclose Kimw Aset Ka Ta Trate db Tsa Tsb Rup Rdown
       DBH DBL
TGOV3D K T1 T2 T3 UO UC PMAX PMIN T4 K1 T5 K2 T6 K3 TA TB TC PRMAX DBH DBL Trate
DEGOV1D M T1 T2 T3 K T4 T5 T6 TD TMAX TMIN DROOP TE DBH DBL Trate
GAST2AD W X Y Z ETD TCD Trate T MAX MIN ECR K3 A B C TAUF KF K5 K4 T3 T4 TAUT T5 AF1 BF1 AF2 BF2 CF2
        TR K6 TC DBH DBL
GASTWD KDROOP KP KI KD ETD TCD Trate T MAX MIN ECR K3 A B C TAUF KF K5 K4 T3 T4 TAUT T5 AF1 BF1 AF2
       BF2 CF2 TR K6 TC TD
GASTWDD KDROOP KP KI KD ETD TCD Trate T MAX MIN ECR K3 A B C TAUF KF K5 K4 T3 T4 TAUT T5 AF1 BF1 AF2
        BF2 CF2 TR K6 TC TD DBH DBL
WESGOVD DTC DTP DROOP KP TI T1 T2 ALIM TPE DBH DBL Trate
HYGOVD R r Tr Tf Tg VELM GMAX GMIN TW At Dturb qNL DBH DBL Trate
IEEEG3 TG TP UO UC PMAX PMIN Rperm Rtemp TR TW A11 A13 A21 A23
IEEEG3D TG TP UO UC PMAX PMIN Rperm Rtemp TR TW A11 A13 A21 A23 DBH DBL Trate
HYGOV2D KP KI KA T1 T2 T3 T4 T5 T6 TR Rtemp R VGMAX GMAX GMIN PMAX DBH DBL Trate
PIDGOVD Feedback Rperm Treg Kp Ki Kd Ta Tb Dturb G0 G1 P1 G2 P2 P3 GMAX GMIN Atw Tw VELMAX VELMIN
     DBH DBL Trate
WPIDHYD Treg Reg Kp Ki Kd Ta Tb VELMAX VELMIN GMAX GMIN Tw PMAX PMIN D G0 G1 P1 G2 P2 P3 DBH DBL
     Trate
HYGOVR1 DB1 ERR Td T1 T2 T3 T4 T5 T6 T7 T8 Kp R Tt Kg Tp VELOPEN VELCLOSE PMAX PMIN DB2 Tw At Dturb
     qNL Trate
H6E Fd Trate Re Rg Tpe Tsp Kp Ki Kd Td Velm GMAX GMIN Buf Buv Kg Tg BLG DBBD Tbd BLB DBBS Tbs Bgvmin
    Blv Dturb Pgc Deff Hdam Tw Sprate GV1 GV2 GV3 GV4 GV5 GV6 GV7 GV8 GV9 GV10 PGV1 PGV2 PGV3 PGV4
    PGV5 PGV6 PGV7 PGV8 PGV9 PGV10 BGV1 BGV2 BGV3 BGV4 BGV5 BGV6 BGV7 BGV8 BGV9 BGV10
HYG3 Cflag Rgate Relec Tt Td K2 Ki K1 Tf Kg Tp VELOPEN VELCLOSE PMAX PMIN DB2 GV1 PGV1 GV2 PGV2 GV3
     PGV3 GV4 PGV4 GV5 PGV5 GV6 PGV6 H0 qNL Tw At Dturb Trate DB1 EPS DB1L
"""
# PowerWorld's lists of parameters, without what they say that only PowerWorld has
POWERWORLD = """
PSSSB ICS1 REMBUS1 ICS2 REMBUS2 M N TW1 TW2 TW3 TW4 T6 T7 KS2 KS3 KS4 T8 T9 KS1 T1 T2 T3 T4 VSTMAX
      VSTMIN SW1 TD1 TD2 VTL VK VCUTOFF
DC1C OEL UEL TR KA TA TB TC VRMAX VRMIN KE TE KF TF E1 SE1 E2 SE2 VEMAX VEMIN
DC2C OEL UEL TR KA TA TB TC VRMAX VRMIN KE TE KF TF E1 SE1 E2 SE2 VEMAX VEMIN
DC4C OEL UEL SCL SW1 TR KPR KIR KDR TDR VRMAX VRMIN KA TA KE TE KF TF VEMIN E1 SE1 E2 SE2
     KP KI XL THETAP KC1 VBMAX
ST4C VOS OEL UEL SCL SW1 TR KPR KIR VRMAX VRMIN KPM KIM VMMAX VMMIN TA VAMAX VAMIN KG TG VGMAX KP
     KI XL THETAP KC VBMAX
ST5C OEL UEL TR TC1 TB1 TC2 TB2 KR VRMAX VRMIN T1 KC TUC1 TUB1 TUC2 TUB2 TOC1 TOB1 TOC2 TOB2
ST6C OEL UEL SCL SW1 TR KPA KIA KDA TDA VAMAX VAMIN KFF KM KCI KLR ILR VRMAX VRMIN KG TG VMMAX
     VMMIN TA KP KI XL THETAP KC VBMAX
ST7C OEL UEL TR TG TF VMAX VMIN KPA VRMAX VRMIN KH KL TC TB KIA TIA TA
ST8C OEL UEL SCL SW1 TR KPR KIR VPIMAX VPIMIN KPA KIA VAMAX VAMIN KA TA VRMAX VRMIN KF TF KC1 KP
     KI1 XL THETAP VB1MAX KC2 KI2 VB2MAX
ST9C OEL UEL SCL SW1 TR TCD TBD ZA KA KU TA TAUEL VRMAX VRMIN KAS TAS KP THETAP KI XL KC VBMAX
PSS4B CLI DLI ALI BLI BWLI1 WLI1 BWLI2 WLI2 TH AH BH M BWH1 WH1 BWH2 WH2
      KL1 KL11 TL1 TL2 TL3 TL4 TL5 TL6 KL2 KL17 TL7 TL8 TL9 TL10 TL11 TL12 KL VLMAX VLMIN
      KI1 KI11 TI1 TI2 TI3 TI4 TI5 TI6 KI2 KI17 TI7 TI8 TI9 TI10 TI11 TI12 KI VIMAX VIMIN
      KH1 KH11 TH1 TH2 TH3 TH4 TH5 TH6 KH2 KH17 TH7 TH8 TH9 TH10 TH11 TH12 KH VHMAX VHMIN
      VSTMAX VSTMIN
PSS4C CLI DLI ALI BLI BWLI1 WLI1 BWLI2 WLI2 TH AH BH M BWH1 WH1 BWH2 WH2
      KL1 KL11 TL1 TL2 TL3 TL4 TL5 TL6 KL2 KL17 TL7 TL8 TL9 TL10 TL11 TL12 KL VLMAX VLMIN
      KI1 KI11 TI1 TI2 TI3 TI4 TI5 TI6 KI2 KI17 TI7 TI8 TI9 TI10 TI11 TI12 KI VIMAX VIMIN
      KH1 KH11 TH1 TH2 TH3 TH4 TH5 TH6 KH2 KH17 TH7 TH8 TH9 TH10 TH11 TH12 KH VHMAX VHMIN
      VSTMAX VSTMIN KVL1 KVL11 TVL1 TVL2 TVL3 TVL4 TVL5 TVL6 KVL2 KVL17 TVL7 TVL8 TVL9 TVL10
      TVL11 TVL12 KVL VVLMAX VVLMIN
"""
# files of real plants: mathworks/Simscape-Electrical-Power-Plant-Model-Validation (8036ab1a), whose
# values have names; JEisenbarth's writers of COULEE24 and MCNPH1 (d3391282, 14d2c360), exac8b and
# exst1 of CENTRG1 and CHJ1 (bfdbf070, 593d84e3)
OF_PLANTS = """
genrou Tpd0 Tppd0 Tpq0 Tppq0 H D Xd Xq Xpd Xpq Xppd Xl S10 S12 RA RCOMP XCOMP ACCEL
gentpj Tpd0 Tppd0 Tpq0 Tppq0 H D Xd Xq Xpd Xpq Xppd Xppq Xl S10 S12 RA RCOMP XCOMP ACCEL Kis
gentpf Tpd0 Tppd0 Tpq0 Tppq0 H D Xd Xq Xpd Xpq Xppd Xppq Xl S10 S12 RA RCOMP XCOMP ACCEL
esst4b TR KPR KIR TA VRMAX VRMIN KPM KIM VMMAX VMMIN KG KP THETAP KI KC XL VBMAX VGMAX
esst1a TR VIMAX VIMIN TC TB KA TA VRMAX VRMIN KC KF TF TC1 TB1 VAMAX VAMIN ILR KLR UELIN PSSIN
exst1 TR VIMAX VIMIN TC TB KA TA VRMAX VRMIN KC KF TF TC1 TB1 VAMAX VAMIN XE ILR KLR
exac8b TR KPR KIR KDR TDR VIMAX TA VRMAX VRMIN KE TE KC KD E1 SE1 E2 SE2 LIMFLG
esst5b TR KR T1 KC VRMAX VRMIN TC1 TB1 TC2 TB2 TOC1 TOB1 TOC2 TOB2 TUC1 TUB1 TUC2 TUB2
rexs TR KVP KVI VIMAX TA TB1 TC1 TB2 TC2 VRMAX VRMIN KF TF TF1 TF2 FBF KIP KII TP VFMAX VFMIN KH KE
     TE KC KD E1 SE1 E2 SE2 RCOMP XCOMP NVPHZ KVPHZ FLIMF XC VCMAX KEFD LIMFLG
pss2a ICS1 REMBUS1 ICS2 REMBUS2 TW1 TW2 TW3 TW4 T6 T7 KS2 KS3 KS4 T8 T9 N M KS1 T1 T2 T3 T4
      VSTMAX VSTMIN A TA TB
pss2b ICS1 REMBUS1 ICS2 REMBUS2 VSI1MAX VSI1MIN TW1 TW2 VSI2MAX VSI2MIN TW3 TW4 T6 T7 KS2 KS3 T8 T9
      N M KS1 T1 T2 T3 T4 T10 T11 VSTMAX VSTMIN A TA TB KS4
wsccst ICS KQV TQV KQS TQS TQ TQ1 TPQ1 TQ2 TPQ2 TQ3 TPQ3 VSMAX VCUTOFF VSMIN T1 T2 T3 KBOOST DW1 DW2
       DDWT TDELAY T4 SW1 TD1 TD2 VTL VK
hyg3 PMAX PMIN Cflag Rgate Relec Td Tf Tp VELOPEN VELCLOSE K1 K2 Ki Kg Tt DB1 EPS DB2 Tw At Dturb
     qNL H0 GV1 PGV1 GV2 PGV2 GV3 PGV3 GV4 PGV4 GV5 PGV5 GV6 PGV6
hygovr PMAX PMIN R Td T1 T2 T3 T4 T5 T6 T7 T8 Tp VELOPEN VELCLOSE Kp Kg GMAX GMIN Tt DB1 EPS DB2 Tw
       At Dturb qNL H0 GV1 PGV1 GV2 PGV2 GV3 PGV3 GV4 PGV4 GV5 PGV5 GV6 PGV6
ggov1 R Rselect Tpelec maxerr minerr Kpgov Kigov Kdgov Tdgov VMAX VMIN Tact Kturb Wfnl Tb Tc Flag
      Teng Tfload Kpload Kiload Ldref Dm Ropen Rclose Kimw PMWSET Aset Ka Ta db Tsa Tsb Rup Rdown
"""
# PowerWorld's list of the models of PSLF
OF_LIST = """
pss1a ICS REMBUS A1 A2 T1 T2 T3 T4 T5 T6 KS VSTMAX VSTMIN VCU VCL
exeli TFV TFI TNU VPU VPI VPNF DPNF EFMIN EFMAX XE TW KS1 KS2 TS1 TS2 SMAX
exdc4 KR TRH KV VRMAX VRMIN TE KE E1 SE1 E2 SE2
exdc2a TR KA TA TB TC VRMAX VRMIN KE TE KF TF1 TF2 E1 SE1 E2 SE2
tgov3 K T1 T2 T3 UO UC PMAX PMIN T4 K1 T5 K2 T6 K3 TA TB TC PRMAX GV1 PGV1 GV2 PGV2 GV3 PGV3 GV4
      PGV4 GV5 PGV5 GV6 PGV6
exst3a TR VIMAX VIMIN KA TC TB KM TM VMMAX VMMIN KG KP KI VBMAX KC XL VGMAX THETAP
esac7b TR KPR KIR KDR TDR VRMAX VRMIN KPA KIA VAMAX VAMIN KP KL TE VFEMAX VEMIN KE KC KD KF1 KF2 KF3
       TF E1 SE1 E2 SE2 SPDMLT
"""


def orders(text):
    """Return the names of each record in their order; a line with a margin continues the last."""
    found = {}
    for line in text.replace("\n ", " ").split("\n"):
        name, *symbols = line.split() or [""]
        found[name] = symbols
    return {name: symbols for name, symbols in found.items() if name}


ORDERS = {
    **orders("".join((OPAL_RT, OPENIPSL, INTERPSS, OF_POWERWORLD, POWERWORLD, OF_PLANTS, OF_LIST))),
    "ESAC8B": AS_ESAC8B.split(),
}
# typed from the one source that there is: PowerWorld's list, InterPSS's files (ST2C, ST3C), and for
# ESURRY a record of a plant, with which InterPSS's order gives TD = 400 s and K10 = 1
OF_ONE_SOURCE = {"ESURRY", "PSS5C", "OEL2C", "OEL3C", "UEL2C", "ST2C", "ST3C"}
OF_ONE_SOURCE |= {"OEL2CU1"}  # which is OEL2C's, with two values exchanged as there
# those without a dead band: the order of the form with one, and of PSS/E's IEEEG2 by its diagram
OF_ONE_SOURCE |= {"lcfb1", "HYGOV2", "WPIDHY", "IEEEG2"}
# of PSLF: files that are not at hand, a list of parameters, or taken to be as in PSS/E
OF_ONE_SOURCE |= {
    *("gensal", "genqec", "genqej", "exac4", "exst4b", "ieeest", "tgov1", "ieeeg1"),
    *("esac1a", "esac2a", "esac3a", "esac4a", "esac5a", "esac6a", "esac8b", "esdc1a", "esdc2a"),
    *("exac1", "exac2", "exdc2", "expic1", "exdc1", "sexs", "esst2a", "esst3a", "esst7b", "hygov"),
}

LIMITER_RECORDS = [
    Definition("limiter", model, record) for model in LIMITERS.values() for record in model.records
]
RECORDS = {
    f"{each.model.name} as {each.record.name}": each
    for each in (*definitions(PSSE), *definitions(PSLF), *LIMITER_RECORDS)
}


def fields_of(definition, words):
    """Return the fields of a record of a file with these values."""
    name = definition.record.name
    if definition.program == PSLF:
        ((head,), faults) = heads(f'{name} 7 "A" 15.0 "1" : #9 {" ".join(words)}\n')
        assert faults == []
        return head.fields
    (record,), faults = sound_records(f"7 '{name}' 1 {' '.join(words)} /\n")
    assert faults == []
    return record.fields[3:]


def test_each_record_has_an_order_typed_here_or_one_source_only():
    names = {each.record.name for each in RECORDS.values()}
    assert names == ORDERS.keys() | OF_ONE_SOURCE
    assert not ORDERS.keys() & OF_ONE_SOURCE


@pytest.fixture(
    params=[name for name, each in RECORDS.items() if each.record.name not in OF_ONE_SOURCE]
)
def definition(request):
    """Name each record whose order is typed here in turn."""
    return RECORDS[request.param]


def order_of(definition):
    """Return the typed order with the symbols of the model: ESAC8B may be an AC8B."""
    order = ORDERS[definition.record.name]
    if (definition.model.name, definition.record.name) == ("AC8B", "ESAC8B"):
        other = {"KP": "KPR", "KI": "KIR", "KD": "KDR", "TD": "TDR"}
        return [other.get(symbol, symbol) for symbol in order]
    return order


def test_each_value_of_a_file_is_read_as_what_the_source_names_it(definition):
    order = order_of(definition)
    words = [str(place) for place, _ in enumerate(order, start=1)]
    fields = fields_of(definition, words)
    placed = dict(zip(definition.names, (field.text for field in fields), strict=True))
    assert placed == dict(zip(order, words, strict=True))


def test_each_value_of_a_model_is_written_where_the_source_has_its_name(definition):
    order = order_of(definition)
    values = {symbol: float(place) for place, symbol in enumerate(order, start=1)}
    written = dict(zip(order, record_fields(definition, values), strict=True))
    own = {row.symbol for row in definition.model.sheet}
    assert {name: float(written[name]) for name in own & written.keys()} == {
        name: values[name] for name in own & values.keys()
    }


def read(definition, words):
    """Return what a record of a file with these values says."""
    return read_values(definition, 1, fields_of(definition, words))


@pytest.fixture(params=RECORDS)
def record_of_any_kind(request):
    """Name each record of both programs and of the limiters in turn."""
    return RECORDS[request.param]


def test_a_value_too_many_is_refused(record_of_any_kind):
    words = record_fields(record_of_any_kind, typical(record_of_any_kind.model.sheet))
    count = f"{len(words) + 1} values after the id, but the record has {len(words)} "
    for place in range(len(words) + 1):
        reading = read(record_of_any_kind, [*words[:place], "0", *words[place:]])
        assert any(count in fault.text for fault in reading.faults)


def test_a_value_too_few_is_refused_or_one_of_pslf_that_does_nothing_is_lacking(record_of_any_kind):
    """Older releases of PSLF end before values that do nothing: of those one may be named."""
    definition, record = record_of_any_kind, record_of_any_kind.record
    words = record_fields(definition, typical(definition.model.sheet))
    last, count = definition.names[-1], f"{len(words) - 1} value"
    lacking = f"{record.name}: not in the file, taken as without effect: {last}"
    for place in range(len(words)):
        reading = read(definition, words[:place] + words[place + 1 :])
        if definition.program == PSLF and last in record.ignored:
            continue  # a speed multiplier, say
        if definition.program == PSLF and last in dict(record.absent):
            assert lacking in [warning.text for warning in reading.warnings] or reading.faults
        else:
            assert any(count in fault.text for fault in reading.faults)


def test_a_feedback_without_a_gain_needs_no_lag(record_of_any_kind):
    """As in the files of two hydro plants; with a gain the lag is a fault."""
    definition, model = record_of_any_kind, record_of_any_kind.model
    values = typical(model.sheet) | {"KN": 0.0}
    gain = "KF3" if "KF3" in values else "KF"
    lags = [row for row in model.sheet if row.symbol.startswith("TF") and row.low > 0.0]
    for row in lags if gain in values else []:
        for size, refused in ((0.0, False), (0.05, True)):
            words = record_fields(definition, {**values, gain: size, row.symbol: 0.0})
            reading = read(definition, words)
            fault = f"{definition.record.name}: {row.symbol}: 0 lies outside "
            assert [text.startswith(fault) for _, text in reading.faults] == [True] * refused
            if not refused:
                assert reading.values[row.symbol] == row.typical


def test_a_limit_far_beyond_its_sheet_is_none(record_of_any_kind):
    """As 99999 in files that others converted; a ceiling as far below its sheet is a fault."""
    definition, far = record_of_any_kind, {"MAX": 1e7, "LIM": 1e7, "MIN": -1e7}
    values, name = typical(definition.model.sheet), definition.record.name
    rows = [row for row in definition.model.sheet if row.symbol[-3:] in far]
    for row in rows:
        if row.symbol not in definition.names:
            continue
        limit = far[row.symbol[-3:]]
        reading = read(definition, record_fields(definition, {**values, row.symbol: limit}))
        end = row.high if limit > 0.0 else row.low
        assert (reading.faults, reading.values[row.symbol]) == ([], end)
        assert [text for _, text in reading.warnings].count(
            f"{name}: {row.symbol}: {show(limit)} is no limit; {show(end)} is taken"
        ) == 1
        other = read(definition, record_fields(definition, {**values, row.symbol: -limit}))
        assert any(f"{row.symbol}: {show(-limit)} lies outside" in text for _, text in other.faults)


def test_a_saturation_of_next_to_nothing_is_none(record_of_any_kind):
    """As 1e-6 at 1.0 pu and 0 at 1.2 pu in a public file; one that falls from more is a fault."""
    definition = record_of_any_kind
    if definition.kind != "machine":
        return
    values = typical(definition.model.sheet)
    words = record_fields(definition, {**values, "S10": 1e-6, "S12": 0.0})
    reading = read(definition, words)
    assert (reading.faults, reading.unused[-1]) == ([], ("S10", 1e-6))
    assert reading.values["S10"] == reading.values["S12"] == 0.0
    falling = read(definition, record_fields(definition, {**values, "S10": 0.05, "S12": 0.01}))
    assert any("0.01 at 1.2 pu is not above" in text for _, text in falling.faults)


def test_pss4c_with_two_bus_numbers_and_without_its_last_limits_is_refused():
    """InterPSS has such a file: its 94 values are as many as the record's."""
    definition = RECORDS["PSS4C as PSS4C"]
    words = record_fields(definition, dict.fromkeys(definition.names, 0.5))
    shifted = [words[0], "0", words[1], "0", *words[2:-2]]
    assert len(shifted) == len(definition.names)
    faults = [fault.text for fault in read(definition, shifted).faults]
    assert "PSS4C: BLI: 0 leaves the transducer with ALI = 0.5 undamped" in faults


@pytest.mark.parametrize("program", [PSSE, PSLF])
def test_what_a_record_stands_for_is_not_lost_in_it(program):
    for definition in definitions(program):
        held = dict(definition.record.held)
        values = {**typical(definition.model.sheet), **held}
        warned = " ".join(warnings_of(Written(definition, values, {}, {})))
        assert not any(f"cannot hold {symbol} " in warned for symbol in held), definition.record
