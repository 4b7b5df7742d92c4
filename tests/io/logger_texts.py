"""One coast-down as the loggers of test drivers export it: the text of each format."""

from __future__ import annotations

from datetime import datetime, timedelta

import numpy as np

N = 600
TIME = np.arange(N) / 20.0
SPEED = np.round(70.0 - 0.8 * TIME, 2)  # km/h
MIDNIGHT = datetime(2026, 5, 1, 23, 59, 50)


def rows(line: str) -> str:
    """A line for each sample; fields: t, v, the moments d and u."""
    samples = zip(TIME, SPEED, [MIDNIGHT + timedelta(seconds=float(t)) for t in TIME], strict=True)
    fields = (
        {"t": t, "v": v, "m": v / 3.6, "d": d, "u": 1.62e9 + t, "ms": d.microsecond // 1000} for t, v, d in samples
    )
    return "".join(line.format(**one) + "\n" for one in fields)


MOTEC = (
    '"Format","MoTeC CSV File",,,"Workbook",""\n"Venue","Oval",,,"Worksheet",""\n'
    '"Log Date","12/05/2026",,,"Origin Time","0.000","s"\n'
    '"Sample Rate","20.000","Hz",,"End Time","30.0","s"\n"Beacon Markers",""\n\n\n'
    '"Time","Distance","Ground Speed"\n"s","m","km/h"\n\n' + rows('"{t:.3f}","{t:.1f}","{v:.2f}"')
)
RACECHRONO = (
    "This file is created by a lap timer\nFormat,3\nTrack name,Oval\nNote,\n\n"
    "timestamp,lap_number,elapsed_time,satellites,speed,combined_acc,bearing,altitude\n"
    "unix time,,s,sats,m/s,G,deg,m\n,,,100: gps,100: gps,calc,100: gps,100: gps\n"
    + rows("{u:.3f},,{t:.3f},12,{m:.6f},0.02,91,300.1")
)
DATED = "Device Time, Speed (OBD)(km/h),G(x)\n" + rows("{d:%d-%b-%Y %H:%M:%S.%f}, {v:.2f}, 0.01")
ISO = "Timestamp;v\n;km/h\n" + rows("{d:%Y-%m-%dT%H:%M:%S.%f}Z;{v:.2f}")
OF_DAY = "Time;v [km/h]\n" + rows("{d:%H:%M:%S.%f};{v:.2f}").replace(".", ",")
VBO = (
    "File created on 01/05/2026 at 23:59:50\r\n\r\n[header]\r\nsatellites\r\ntime\r\nlatitude\r\nlongitude\r\n"
    "velocity kmh\r\nheading\r\nheight\r\nFront_Load\r\nBrake\r\n\r\n[channel units]\r\nkN\r\n\r\n\r\n[comments]\r\n"
    "Log Rate (Hz) : 20.00\r\n\r\n[column names]\r\nsats time lat long velocity heading height Front_Load Brake\r\n\r\n"
    "[data]\r\n" + rows("008 {d:%H%M%S.%f} +03119.09973 +00058.49277 {v:07.3f} 091.20 +00300.40 7.12E+00 0")
)
LONG = '"SECONDS";"PID";"VALUE";"UNITS";\n' + rows(
    '"{t:.3f}";"Vehicle speed";"{v:.2f}";"km/h";\n"{t:.3f}";"Intake air temperature";"131";"℉";'
)
MESSAGES = "Time[s];ID;Name;VehicleSpeed[km/h];EngineSpeed[rpm]\n" + rows(
    "{t:.2f};0x1A0;ESP_v;{v:.2f};\n{t:.2f}7;0x280;Motor_1;;800"
)
RECORDER = (
    'Vendor,"Recorder"\nTempUnit,C\nSampling interval,50ms\nStart time,2026-05-01,23:59:50\nAMP settings\n'
    'CH,Signal name,Amp,Input,Range,Filter,Span,,Unit,Color\nCH5," CH 5","M",DC,2V,Off,+50.00,-50.00,[A],28\n'
    "CH,Input,Slope,Filter,Span,,Unit,Color,,,Line Width\n"
    + "".join(f"Pulse{i},COUNT,L,,500000,0,[C],28,5,6,0\n" for i in range(1, 5))
    + "Calc settings\nData\nNumber,Date&Time,ms,CH5,CH6,Alarm1-10,AlarmOut\n"
    'NO.,Time,ms,"km/h","V","A1234567890","AO1234"\n'
    + rows("  7,{d:%Y/%m/%d %H:%M:%S},{ms:3d},+ {v:.2f},- 0.10,LLLL,LL")
)
STATION = (
    "Device Name,HEAT\nDevice Model,5400\nFORMATTED DATE_TIME,Temperature,Relative Humidity,Wind Speed,Direction\n"
    "yyyy-MM-dd hh:mm:ss a,°C,%,km/h,Deg,Data Type,Location address,Notes\n"
    + rows('{d:%Y-%m-%d %I:%M:%S.%f %p},28.9,45.7,{v:.2f},--,point,"22 Rue, France",')
)
AIM = (
    '"Format","AiM CSV File"\n"Session","Oval"\n"Sample Rate","20"\n"Beacon Markers","15.000","30.000"\n\n'
    '"Time","Ground Speed","Lap Heading"\n"sec","km/h",""\n"1","2","3"\n\n' + rows('"{t:.3f}","{v:.2f}","91.0"')
)
CALIBRATION = (
    "ETASAsciiItemFile\trecord\tCrLf\tTab\nsampleCount\t600\ntime\tVehV_v\\ETKC:1\tEng_n\\ETKC:1\t\n"
    'f8\tf8\tf8\t\n"s"\t"km/h"\t"rpm"\t\n' + rows("{t:.3f}\t{v:.2f}\t780\t")
)
BARRED = (
    '"Interval"|"ms"|0|0|1,"Speed"|"km/h"|0.0|150.0|20,"GPSSats"|""|0|20|10\n'
    + "".join(f"{4000 + 50 * k},{v:.2f},{9 if k % 2 else ''}\n" for k, v in enumerate(SPEED))
)  # fmt: skip
MINUTES = "Elapsed,Speed (km/h)\n" + "".join(
    f"{t // 60:02.0f}:{t % 60:05.2f},{v}\n" for t, v in zip(TIME, SPEED, strict=True)
)
INDEX = ",speed_kmh\n" + "".join(f"0 days 00:00:{t:09.6f},{v}\n" for t, v in zip(TIME, SPEED, strict=True))
YEAR_LAST = "GPS Time;v\n;km/h\n" + rows("{d:%a %b %d %H:%M:%S.%f} GMT+01:00 {d:%Y};{v:.2f}")
DIGITS = "satellites,time,velocity [km/h]\n" + rows("9,{d:%H%M%S.%f},{v:.2f}")
COLON = "Time;v [km/h]\n" + rows("{d:%H:%M:%S}:{ms:03d};{v:.2f}")
SECTIONS = (
    "Log File\nVersion: 1.0\n\n[Channel Information]\n0,12,13\nOffset,Engine RPM (SAE),Vehicle Speed (SAE)\n"
    "s,rpm,km/h\n\n[Channel Data]\n" + rows("{t:.3f},800,{v:.2f}")
)
GROUPS = (
    "Tuesday,12,May,2026,09:12:05,Version: 2\n8X0 906 018,,1.8L\n\n,Group A:,'001,,Group B:,'005,\n"
    ",,Engine Speed,Engine Load,,Vehicle Speed,Status\n,TIME,(G28),,TIME,,\nMarker,STAMP, /min, %,STAMP, km/h, \n"
    + rows(",{t:.2f},800,15.0,{t:.2f},{v:.2f},Idle")
)
BEHIND = "TIMESTAMP,MODEL,RPM,SPEED\n" + rows("{t:.3f},two,800 rpm,{v:.2f}km/h")
DECODED = "TimeStamp,CAN ID,Signal,Raw Value,Physical Value\n" + rows(
    "{d:%Y-%m-%d %H:%M:%S.%f}+00:00,217,VehSpd[km/h],9,{v:.2f}\n{d:%Y-%m-%d %H:%M:%S.%f}+00:00,300,Gear,3,3"
)
TAGGED = "t:Time:s:3:0:1;kmh:Speed GNSS:km/h:1:0:0;v_in:Input voltage:V:2:0:0\n" + rows("{t:.3f};{v:.2f};50.1")
MARKED = '# Lap timer\n"Time","Engine Speed (RPM) *OBD","Vehicle Speed (km/h) *OBD"\n' + rows("{t:.3f},800,{v:.2f}")
REMARK = "Time [s],RPM,VSS1 [km/h]\nLog started on the way out\n" + rows("{t:.3f},800,{v:.2f}")
COMMENTS = "Zeit;v_Fzg;T_Aussen\ns;km/h;°C\nZeitkanal;CAN ESP_21;Klima\n" + rows("{t:.3f};{v:.2f};#NV")
TWO_ROWS = (
    "\t\tTemp\tWind\tWind\tHi\tHi\t\nDate\tTime\tOut\tSpeed\tDir\tSpeed\tDir\tBar\n\t\tC\tkm/h\t\tkm/h\t\thPa\n"
    + rows("{d:%d.%m.%Y}\t{d:%H:%M:%S.%f}\t11.2\t{v:.2f}\tENE\t99.5\tE\t983.1")
)
WHEELS = ",FL,FL,RL,RL,Car\nTime,Fx,Fz,Fx,Fz,Speed\ns,N,N,N,N,km/h\n" + rows("{t:.3f},1.5,3000.5,1.5,2500.5,{v:.2f}")
COUNTED = "Time [s]\tv [km/h]\tz [mm]\n0\t1\t2\n" + rows("{t:.3f}\t{v:.2f}\t410.0")
AGAIN = OF_DAY.splitlines(keepends=True)
EXPORTS = {
    "motec.csv": (MOTEC, "Time", "Ground Speed", "km/h"),
    "racechrono.csv": (RACECHRONO, "elapsed_time", "speed", "m/s"),
    "dated.csv": (DATED, "Device Time", "Speed (OBD)(km/h)", "km/h"),
    "iso.csv": (ISO, "Timestamp", "v", "km/h"),
    "of_day.csv": (OF_DAY, "Time", "v [km/h]", "km/h"),
    "long.csv": (LONG, "SECONDS", "Vehicle speed", "km/h"),
    "recorder.csv": (RECORDER, "Date&Time", "CH5", "km/h"),
    "station.csv": (STATION, "FORMATTED DATE_TIME", "Wind Speed", "km/h"),
    "vbox.vbo": (VBO, "time", "velocity", "km/h"),
    "aim.csv": (AIM, "Time", "Ground Speed", "km/h"),
    "calibration.ascii": (CALIBRATION, "time", "VehV_v\\ETKC:1", "km/h"),
    "digits.csv": (DIGITS, "time", "velocity [km/h]", "km/h"),
    "colon.csv": (COLON, "Time", "v [km/h]", "km/h"),
    "minutes.csv": (MINUTES, "Elapsed", "Speed (km/h)", "km/h"),
    "year_last.csv": (YEAR_LAST, "GPS Time", "v", "km/h"),
    "sections.csv": (SECTIONS, "Offset", "Vehicle Speed (SAE)", "km/h"),
    "groups.csv": (GROUPS, "TIME#1", "Vehicle Speed", "km/h"),
    "behind.csv": (BEHIND, "TIMESTAMP", "SPEED", "km/h"),
    "decoded.csv": (DECODED, "TimeStamp", "VehSpd[km/h]", "km/h"),
    "tagged.csv": (TAGGED, "Time", "Speed GNSS", "km/h"),
    "marked.csv": (MARKED, "Time", "Vehicle Speed (km/h) *OBD", "km/h"),
    "remark.csv": (REMARK, "Time [s]", "VSS1 [km/h]", "km/h"),
    "comments.csv": (COMMENTS, "Zeit", "v_Fzg", "km/h"),
    "two_rows.txt": (TWO_ROWS, "Time", "Wind Speed", "km/h"),
    "wheels.csv": (WHEELS, "Time", "Car Speed", "km/h"),
    "counted.asc": (COUNTED, "Time [s]", "v [km/h]", "km/h"),
    "again.csv": ("".join([*AGAIN[:300], AGAIN[0], *AGAIN[300:]]), "Time", "v [km/h]", "km/h"),
}
