"""What plants, makers and languages call their channels: the words of made-up recorder's files.

They are collected from what engineers write, whatever exfit's table of signals holds. OTHERS are
channels that are none of the signals, each with what it is made of.
"""

TERMINAL_VOLTAGE = (
    "Generator voltage", "Gen Volts", "GEN VOLTAGE", "Vgen", "Vterm", "UG", "Stator voltage",
    "Stator V", "Machine voltage", "Terminal V", "Tension alternateur", "Tension générateur",
    "Tension stator", "Tensión generador", "Tensión del estator", "Tensión en bornes",
    "Tensão gerador", "Tensão terminal", "Tensão do estator", "Ständerspannung",
    "Maschinenspannung", "Statorspannung", "Generator-Klemmenspannung", "Gen. terminal voltage",
    "GenVoltAvg", "Vgen LL avg", "U Stator", "UGen mittel", "GT1 VT", "G2_UG", "Armature voltage",
    "VAVG GEN", "AVR PV Ug", "M1.Ugen", "Uterm", "Vs gen",
)  # fmt: skip
FIELD_VOLTAGE = (
    "Field voltage", "Rotor voltage", "Rotorspannung", "Läuferspannung", "Polradspannung",
    "Feldspannung", "Tension rotor", "Tension de champ", "Tensión de campo", "Tensión del rotor",
    "Tensão de campo", "Tensão rotor", "Vfield", "VFLD", "Main field volts", "U Feld", "Urot",
    "Vrotor", "FIELD_VOLTS", "Fld V", "Vfd", "Efd", "GT1 VFD", "Ufd", "Gen field voltage",
    "Field VDC", "Vcc campo",
)  # fmt: skip
FIELD_CURRENT = (
    "Field current", "Rotor current", "Rotorstrom", "Läuferstrom", "Polradstrom", "Feldstrom",
    "Courant rotor", "Courant de champ", "Corriente de campo", "Corriente del rotor",
    "Corrente de campo", "Corrente rotor", "Ifield", "IFLD", "Main field amps", "I Feld", "Irot",
    "Irotor", "FIELD_AMPS", "Fld I", "Ifd", "GT1 IFD", "Gen field current", "Field ADC",
)  # fmt: skip
ACTIVE_POWER = (
    "Active power", "Gen MW", "P gen", "Real Power", "Wirkleistung", "Puissance active",
    "Potencia activa", "Potência ativa", "Generator watts", "GEN_MW", "MW", "P [MW]", "Pe",
    "Active load",
)  # fmt: skip
REACTIVE_POWER = (
    "Reactive power", "Gen MVAR", "Q gen", "Blindleistung", "Puissance réactive",
    "Potencia reactiva", "Potência reativa", "Generator vars", "GEN_MVAR", "MVAR", "Q [Mvar]",
    "Reactive load",
)  # fmt: skip
REFERENCE = (
    "AVR setpoint", "Voltage reference", "Vref", "Uref", "AVR_SP", "Sollwert", "Spannungssollwert",
    "Consigne de tension", "Consigna de tensión", "Referência de tensão", "V setpt", "AUTO REF",
)  # fmt: skip
# channel -> what it is made of
OTHERS = {
    "Bus voltage": "bus",
    "Grid V": "bus",
    "Netzspannung": "bus",
    "HV busbar U": "bus",
    "Tension réseau": "bus",
    "Tensión de barra": "bus",
    "Frequency": "frequency",
    "Frequenz": "frequency",
    "Drehzahl": "speed",
    "Shaft speed": "speed",
    "AVR output": "output",
    "Regler-Ausgang": "output",
    "Firing angle": "output",
    "Uc": "output",
    "Exciter field current": "exciter",
    "Exc. field amps": "exciter",
    "Pilot exciter voltage": "pilot",
    "Excitation transformer voltage": "pilot",
    "Rotor temperature": "temperature",
    "Field winding temp": "temperature",
    "Wicket gate": "gate",
    "Voltage error": "error",
    "Regelabweichung": "error",
    "Neutral current": "noise",
    "PSS output": "noise",
    "Breaker 52G": "closed",
    "V/Hz": "volts per hertz",
    "MVAR limit": "limit",
    "MW setpoint": "limit",
}
