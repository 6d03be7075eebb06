"""The words of which recorders, simulators and five languages make the names of their channels.

A word stands without accents, in small letters: läufer as laufer, tensão as tensao. What a signal
is called as a whole, as efd or ug, stands in its row of the table of signals.
"""

import re
import unicodedata
from collections.abc import Iterator, Mapping
from itertools import pairwise

# kind -> its words; those of `otherwise` are of channels that are none of the signals
WORDS: Mapping[str, str] = {
    "filler": """
        rel relative avg average mean mittel mittelwert rms eff meas measured ist istwert actual pv
        filt main active real activa ativa wirk blind mag magnitude dc elec electrical el""",
    "voltage": """
        voltage volt volts vlt v u kv vdc vac vcc vll spannung spg tension tensao voltaje
        voltagem""",
    "current": """
        current curr cur amp amps ampere amperes i ka adc strom courant corriente corrente intensite
        intensidad""",
    "power": "power load watt watts mw kw leistung wirkleistung puissance potencia",
    "reactive": "reactive var vars mvar mvars kvar blindleistung reactiva reativa",
    "stator": """
        gen generator generatoren generador gerador generateur alternateur alternador alternator
        stator estator statorique estatorica stander anker armature machine maschine maschinen
        maquina terminal terminals term bornes klemmen klemme klemm trm""",
    "field": """
        field fld feld rotor rot rotors rotorique rotorica laufer polrad champ campo fd slip
        schleifring bridge""",
    "excitation": "excitation exc excit erreger erregung err excitacion excitacao",
    "exciter": "exciter exciters excitatrice excitatriz excitadora pilot erregermaschine",
    "grid": """
        bus busbar grid network netz reseau red rede barra barras hv ehv sammelschiene system mains
        infinite""",
    "reference": """
        ref reference referenz referencia setpoint setpt setval sp soll sollwert set consigne
        consigna""",
    "speed": "speed spd drehzahl vitesse velocidad velocidade rpm",
    "output": "output out ausgang salida saida sortie",
    "otherwise": """
        temp temperature temperatur temperatura limit limits lim limite limiter uel oel max
        min error deviation abweichung regelabweichung firing angle winkel freq frequency
        frequenz frequence frecuencia frequencia hz hertz gate valve breaker position factor
        pf cos trafo transformer transformador transformateur transformator neutral governor
        turbine pressure vibration trigger status alarm control ctrl steuersatz apparent mva
        scheinleistung spare""",
}
SHORT = frozenset("uvipq")  # letters that begin a word, as in ugen and ifeld
LINKING = ("s", "n", "en")  # letters between the parts of a German word
KINDS: Mapping[str, str] = {word: kind for kind, text in WORDS.items() for word in text.split()}
CAPITAL = re.compile(r"(?<=[a-zäöü])(?=[A-ZÄÖÜ])")  # where a word of a name begins


def folded(text: str) -> str:
    """Return a text in small letters without accents."""
    if text.isascii():
        return text.lower()
    decomposed = unicodedata.normalize("NFKD", text.casefold())
    return "".join(letter for letter in decomposed if not unicodedata.combining(letter))


def tokens(name: str) -> list[str]:
    """Return the words and numbers of a name that marks set apart, folded."""
    return [token for token in re.split(r"[^a-z0-9]+", folded(name)) if token]


def words_of(name: str) -> tuple[str, ...]:
    """Return the words of a name: set apart by marks or capitals, or joined as in ugen."""
    apart = tokens(CAPITAL.sub(" ", name))
    whole = [token for token in tokens(name) if token in KINDS and token not in apart]
    symbols = [first + second for first, second in pairwise(apart) if first in SHORT]  # u_f is uf
    return (*whole, *symbols, *(word for token in apart for word in _parts(token)))


def _parts(token: str) -> tuple[str, ...]:
    """Return the known words that a token is joined of; the token where it is not."""
    text = token.rstrip("0123456789")
    if token in KINDS or len(text) < 2:
        return (token,)
    return next(_joined(text, first=True), (text,))


def _joined(text: str, first: bool) -> Iterator[tuple[str, ...]]:
    """Yield the ways in which a text is joined of known words, the longest first word first."""
    if text in KINDS and (first or len(text) > 1):
        yield (text,)
    for length in range(len(text) - 1, 0, -1):
        word, rest = text[:length], text[length:]
        known = word in KINDS if length > 1 else first and word in SHORT
        if not known:
            continue
        for linking in ("", *LINKING):
            if rest.startswith(linking) and len(rest) > len(linking):
                for others in _joined(rest[len(linking) :], first=False):
                    yield (word, *others)
