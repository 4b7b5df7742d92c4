"""Names that loggers give to the channels of the steps: words, their spellings and languages, and rules for names."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping

# Other spellings of the words in the rules below, also in German, French, Spanish, Italian, Portuguese, Dutch,
# Polish, Czech and Scandinavian languages, without accents.
_SPELLINGS = {
    "speed": "velocity vel spd v vx vss vss1 geschwindigkeit geschw tempo vfzg vitesse velocidad velocidade velocita "
    "snelheid predkosc hastighet hastighed rychlost sog kmph kmh kph mph",
    "accel": "acceleration accelerometer acc beschleunigung beschl specificforce aceleracion aceleracao accelerazione "
    "versnelling przyspieszenie",
    "long": "longitudinal lon inline forward laengs längs longitudinale",
    **{"ax": "accx", "ay": "accy", "az": "accz"},  # of Bosch loggers
    "vert": "vertical vertikal verticale",
    "lat": "lateral quer laterale transversale transversal",
    "drive": "antrieb antriebs",
    "torque": "trq torq tq moment drehmoment couple par coppia binario koppel",
    "motor": "mot emotor em moteur motore",
    "engine": "eng",
    "driveline": "gw",
    "twist": "verdrehung verdrehwinkel torsion torsionswinkel",
    "pressure": "druck",
    "shaft": "welle antriebswelle seitenwelle arbre albero",
    "angle": "winkel angulo angolo",
    "wheel": "whl rad roue rueda ruota roda",
    "elevation": "altitude alt height elev höhe hoehe altitud altitudine",
    "position": "distance dist xdist pos odometer weg strecke distancia distanza",
    "n": "rotation rpm drehzahl varvtal regime giri rotacao",
    "grade": "slope incline gradient steigung pente pendiente pendenza",
    "wind": "viento vento",
    "force": "kraft fuerza forza forca",
    "gyro": "gyroscope gyroskop gyrometer giroscopio",
    "pitch": "nick nickwinkel nicken tangage beccheggio cabeceo",
    "front": "vorn vorne vorder vorderachse vorderachslast avant delantero delantera anteriore voor",
    "rear": "hinten hinter hinterachse hinterachslast heck arriere trasero trasera posteriore achter",
    "left": "links linke linkes gauche izquierda izquierdo sinistra sinistro",
    "right": "rechts rechte rechtes droite derecha derecho destra destro",
    "load": "last achslast radlast radaufstandskraft aufstandskraft charge carga carico",
    "brake": "frein freno freio bremse brems brk",
    "hub": "nabe",
    "fx": "fxw",  # of tire test rigs
    "fz": "fzw",
    "slip": "kappa longslip",
    "fl": "vl lf",
    "fr": "vr rf",
    "rl": "hl lr",
    "rr": "hr",
    "target": "requested request req desired demand demanded command cmd setpoint ref reference soll sollwert cible "
    "sched scheduled",
    "power": "watts watt leistung puissance potencia potenza",
    "max": "maximum min minimum limit lim limited available avail rated nominal predicted",
    "mean": "average avg moyenne media medio mittel mittelwert",
    "error": "err accuracy precision std sigma uncertainty",
    "status": "state valid validity flag quality qf counter crc checksum",
}
SAME_WORD = {spelling: word for word, spellings in _SPELLINGS.items() for spelling in spellings.split()}
OF_ACCELERATION = frozenset(("accel", "ax", "ay", "az", "long", "lat", "vert", "force"))  # with them, g is 9.80665 m/s2
CORNERS = {"fl": ("front", "left"), "fr": ("front", "right"), "rl": ("rear", "left"), "rr": ("rear", "right")}
ELSEWHERE = frozenset(["fl", "fr", "rl", "rr", "front", "rear", "left", "right"])
# Words that name a signal whose unit is always SI: twist.linear.x of ROS (REP 103).
STATES_UNIT = {"m/s": frozenset(("twist", "linear", "x"))}
# With them, a first word M is a torque (German: M_Bremse), as n is a rotational speed.
OF_TORQUE = frozenset(("motor", "brake", "hub", "drive", "shaft", "driveline"))
OF_BATTERY = frozenset(("battery", "bat", "batt", "hv", "pack", "bms"))  # its current is no measure of a torque
# Ways of a rule that name no source, and words of other columns beside which they may name another quantity: the power
# of an electric car's log is that of its battery.
UNSPECIFIC = {"power": OF_BATTERY | {"soc", "charger", "charging", "shift"}}
NOT_DRIVEN = frozenset(("target", "max", "mean", "error", "status"))  # not the measured motion itself

# Words of languages without blanks between words, Chinese, Japanese, Korean and Russian, and joined words.
_JOINED = {
    "speed": "车速 車速 速度 차속 속도 скорость hız",
    "accel": "加速度 가속도 ускорение",
    "long": "纵向 縱向 縦 前后 前後 종방향 продольное",
    "lat": "横向 侧向 橫向 左右 横 횡방향",
    "vert": "垂向 垂直 上下",
    "rotation": "转速 轉速 回転数 회전수",
    "wheel speed": "轮速 輪速",
    "wheel": "车轮 車輪 휠",
    "wind speed": "风速 風速",
    "engine": "发动机 發動機 エンジン",
    "motor": "电机 電機 モーター モータ 모터",
    "torque": "转矩 扭矩 轉矩 トルク 토크",
    "brake": "制动 制動 ブレーキ",
    "pedal": "踏板 ペダル",
    "steering": "转向 方向盘 操舵 ステアリング",
    "position": "里程 距离 距離 거리",
    "elevation": "海拔 高度 標高",
    "grade": "坡度 勾配",
    "wheel hub": "radnabe",
    "body elevation": "aufbauhöhe aufbauhoehe karosseriehöhe",
    "target": "目标 目標 指令 请求 要求",
    "max": "最高 最大 最小",
    "mean": "平均",
    "left": "左",
    "right": "右",
    "front": "前",
    "rear": "后 後",
    "long g": "linealg",
    "driveline": "propshaft prop_shaft propellershaft kardanwelle gelenkwelle",  # not a half-shaft
    "pitch rate": "nickrate nickgeschwindigkeit nickwinkelgeschwindigkeit",
    "lat g": "lateralg",
}
_IN_ENGLISH = {joined: word for word, many in _JOINED.items() for joined in many.split()}
_LONGEST_FIRST = re.compile("|".join(sorted(_IN_ENGLISH, key=len, reverse=True)), re.IGNORECASE)
_NORTH_EAST_DOWN = re.compile(r"(?<![a-z])(vel(?:ocity)?[_ ]?)[ned](?![a-z])", re.IGNORECASE)
# SPN 84 of J1939, CCVS1: the vehicle's speed, which the control unit computes from the wheels.
_FROM_WHEELS = re.compile(r"wheel[ _-]?based(?=[ _-]?(vehicle|veh|speed))", re.IGNORECASE)
_ESTIMATED = re.compile(r"(?<![a-z])(car|vehicle|ego)_?state[._]", re.IGNORECASE)  # a message of the car's motion
_ACCENTS = re.compile("[\u0300-\u0307\u0309-\u036f]")  # without the German dieresis, U+0308


def in_english(name: str) -> str:
    """A name with joined words of other languages in English, separated by blanks, and without accents."""
    plain = unicodedata.normalize("NFC", _ACCENTS.sub("", unicodedata.normalize("NFD", name)))
    plain = _ESTIMATED.sub("", _FROM_WHEELS.sub("", plain))
    plain = _NORTH_EAST_DOWN.sub(r"\1 north ", plain)
    return _LONGEST_FIRST.sub(lambda found: f" {_IN_ENGLISH[found[0].lower()]} ", plain)


_OTHER_SPEEDS = (
    "wheel motor engine wind fan shaft angular rotational pump turbine yaw pitch roll hub bat batt battery crank idle "
    "input output transmission turbo cruise set steering throttle pedal slip sideslip tire wiper n "
    "lat vert y z north east down air pitot airspeed "  # of other directions, and of the air
    "drive driven driveline "  # of the driven wheels
    "lead preceding object obj radar relative rel closing delta difference diff lap sector sim simulated"
)
_NO_HEIGHT = "speed n torque force load accel g rate angle temp temperature pressure roll pitch"

# For each channel: sets of words, all of one of which must be in the name, the most specific set first; words that
# exclude it.
RULES: Mapping[str, tuple[tuple[str, ...], str]] = {
    "speed": (("speed", "twist linear x"), _OTHER_SPEEDS),
    "vehicle_speed": (("speed",), _OTHER_SPEEDS),
    "position": (("position",), "pedal throttle steering gear valve brake accel lat long time"),
    "elevation": (("elevation",), "ride antenna geoid bump hub tank body ground damper wheel sprung unsprung"),
    "drive_torque": (
        ("drive torque", "motor torque", "torque"),
        "brake hub wheel shaft left right steering handwheel eps column friction engine current axle clutch converter "
        "turbine crank pedal driver rider human regen loss reserve vectoring drag bearing bolt roller output "
        "yaw pitch roll x y z aligning overturning lenk reib schlepp l r",
    ),
    "drive_torque_left": (("drive torque left", "motor torque left"), "brake"),
    "drive_torque_right": (("drive torque right", "motor torque right"), "brake"),
    "drive_power": (
        ("drive power", "motor power", "power"),
        "battery bat batt hv heater heating air conditioning ac aux charger charging consumption peak rated max min "
        "engine wheels wheel hp regen steering loss fan left right l r balance mean average avg normalized limit "
        "available brake zone target supply state mode",
    ),
    "drive_force": (("drive force", "traction force"), "brake"),
    "brake_torque": (("brake torque", "brake pressure", "p brake"), ""),
    "acceleration": (
        ("long accel", "ax", "a x", "long a", "long g", "g force x", "accel"),
        # GPS: the derivative of a speed; linear: a phone's acceleration without gravity. Neither is a specific force.
        "lat vert pedal angular ay az y z h down right left position total absolute abs combined magnitude norm gps "
        "derived pitch roll yaw wheel hub seat head unsprung gyro gravity linear user object obj required "
        "centripetal vibration axle from speed torque",
    ),
    "vertical_acceleration": (
        ("vert accel", "accel z", "az", "a z", "vert g", "g force z"),
        "pedal down wheel hub unsprung axle angular gyro seat head",
    ),
    "jerk": (("jerk",), ""),
    "grade": (("grade",), "steer steering bat batt battery temp temperature pressure"),
    "wind_speed": (("wind speed", "headwind"), "cross"),
    "pitch": (("pitch",), "rate"),
    "pitch_rate": (("pitch rate", "gyro y"), ""),
    "body_height_front": (("body elevation", "sprung elevation", "body"), f"rear rl rr unsprung {_NO_HEIGHT}"),
    "body_height_rear": (
        ("body rear elevation", "body rl elevation", "sprung rear elevation", "body rear", "body rl"),
        f"unsprung {_NO_HEIGHT}",
    ),
    "wheel_height_front": (
        ("wheel elevation", "unsprung elevation", "wheel", "unsprung"),
        f"rear rl rr steering {_NO_HEIGHT}",
    ),
    "wheel_height_rear": (
        ("wheel rear elevation", "wheel rl elevation", "unsprung rear", "wheel rear", "wheel rl"),
        f"steering {_NO_HEIGHT}",
    ),
    "front_load": (("front load", "front fz", "front lc"), "fl fr"),
    "rear_load": (("rear load", "rear fz", "rear lc"), "rl rr"),
    "front_left_load": (("fl load", "fl fz", "fl lc"), ""),
    "front_right_load": (("fr load", "fr fz", "fr lc"), ""),
    "rear_left_load": (("rl load", "rl fz", "rl lc"), ""),
    "rear_right_load": (("rr load", "rr fz", "rr lc"), ""),
    "hub_torque": (("hub torque", "wheel torque", "my"), "brake motor"),
    "hub_force_x": (("hub fx", "hub force x", "wheel fx", "fx"), ""),
    "hub_force_z": (("hub fz", "hub force z", "wheel fz", "fz"), ""),
    "force_x": (("fx", "force x", "long force"), ""),
    "force_z": (("fz", "force z", "vert force", "load"), "engine axle calculated cpu bat battery"),
    "wheel_speed": (("wheel speed", "wheel n", "omega"), "motor engine steering yaw pitch roll x y z"),
    "wheel_speed_fl": (("wheel speed fl", "wheel n fl", "n fl", "omega fl"), "motor shaft"),
    "wheel_speed_fr": (("wheel speed fr", "wheel n fr", "n fr", "omega fr"), "motor shaft"),
    "wheel_speed_rl": (("wheel speed rl", "wheel n rl", "n rl", "omega rl"), "motor shaft"),
    "wheel_speed_rr": (("wheel speed rr", "wheel n rr", "n rr", "omega rr"), "motor shaft"),
    "slip": (("slip", "sr"), "angle clutch converter torque belt sideslip"),
    "shaft_torque": (("shaft torque", "driveline torque"), "left right"),
    "shaft_torque_left": (("shaft torque left", "driveline torque left", "shaft torque l", "driveline torque l"), ""),
    "shaft_torque_right": (
        ("shaft torque right", "driveline torque right", "shaft torque r", "driveline torque r"),
        "",
    ),
    "twist": (("twist",), "linear angular"),
    "motor_speed": (
        ("motor speed", "motor n", "motor omega", "engine speed", "engine n", "engine omega", "n"),
        "wheel fl fr rl rr front rear left right fan shaft turbine pump idle output input gear transmission axle "
        "roller drum propeller cadence x y z torque power vehicle",
    ),
    "angle": (("angle",), "steering slip"),
    "angular_rate": (("angular rate", "angular speed", "gyro"), "absolute abs magnitude norm"),
}
