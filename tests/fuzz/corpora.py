"""Writes the small inputs that the fuzz targets begin with: corpora.py PROGRAM EXAMPLES OUT, a folder for each target in OUT.

Examples of what each reader reads, whole; libFuzzer spoils them. PROGRAM (build/vergence) makes the recording: a tenth of a second of the mock.
"""
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "examples"))
from mutate_examples import png, write_bags  # noqa: E402

END = b"\x1e"  # of a file, where an input stands for several
LENS = "size: [96, 72], model: pinhole-radtan, intrinsics: [80, 80, 48, 36], distortion: [0.0, 0.0, 0.0, 0.0]"


def xbus_frame(mid: int, data: bytes) -> bytes:
    """A message to or from device 0xff; the bytes behind the preamble add up to 0."""
    body = bytes([0xFF, mid, len(data)]) + data
    return b"\xfa" + body + bytes([-sum(body) & 0xFF])


def xbus() -> dict:
    packets = struct.pack(">HBI", 0x1060, 4, 1000) + struct.pack(">HB4f", 0x2010, 16, 1, 0, 0, 0)
    packets += struct.pack(">HB3f", 0x4020, 12, 0, 0, 9.81) + struct.pack(">HB2f", 0x5040, 8, -27.5, 153)
    packets += struct.pack(">HB3f", 0xD010, 12, 1, 2, 3) + struct.pack(">HBI", 0xE020, 4, 7)
    mtdata = struct.pack(">9f", *range(9)) + struct.pack(">4f", 1, 0, 0, 0) + struct.pack(">H", 5)
    configuration = struct.pack(">IHHHHI", 0x12345678, 1, 2, 0, 0, 0) + bytes(94) + struct.pack(">HH", 0, 1)
    return {"mtdata2": xbus_frame(0x36, packets), "packets": packets, "mtdata": xbus_frame(0x32, mtdata), "mtdata_bare": mtdata,
            "configuration": xbus_frame(0x0D, configuration), "wake": xbus_frame(0x3E, b"") + xbus_frame(0x42, b"\0\0\0\3")}


def nmea(body: str) -> bytes:
    check = 0
    for c in body.encode():
        check ^= c
    return f"${body}*{check:02X}\r\n".encode()


def ubx(kind: int, number: int, payload: bytes) -> bytes:
    a = b = 0
    body = struct.pack("<BBH", kind, number, len(payload)) + payload
    for byte in body:
        a = (a + byte) & 0xFF
        b = (b + a) & 0xFF
    return b"\xb5\x62" + body + bytes([a, b])


def gnss() -> dict:
    pvt = struct.pack("<IHBBBBBBIiBBBBiiiiII", 1000, 2024, 2, 29, 12, 0, 0, 7, 10, 0, 3, 1, 0, 17, 1530137000, -274975000, 60000, 20000, 500, 800)
    pvt += struct.pack("<iiiiiIIHHIi", 1000, 0, 0, 1000, 0, 50, 100000, 100, 0, 0, 0) + bytes(4)
    return {"gga": nmea("GNGGA,012345.250,2729.85000,S,15300.82200,E,4,17,0.62,20.125,M,39.5,M,1.0,0000"),
            "rmc": nmea("GPRMC,235959,A,2729.85,S,15300.822,W,36.0,270.5,290224,,,A"),
            "others": nmea("GNVTG,10.5,T,,M,1.0,N,36.0,K,A") + nmea("GNGST,120000,1,2,1,0,0.3,0.4,0.9") + nmea("HEHDT,123.4,T"),
            "pvt": ubx(1, 7, pvt)}


def rom() -> dict:
    quadlets = [0x04040000, 0x31333934, 0x2000A002, 0x00B09D01, 0x00123456, 0x00030000, 0x0300B09D, 0x0C0083C0, 0xD1000002, 0,
                0x00030000, 0x1200A02D, 0x13000102, 0xD4000002, 0, 0x00040000, 0x403C0000, 0x81000003, 0x82000008, 0x38000010,
                0x00050000, 0, 0, 0x506F696E, 0x74204772, 0x65790000, 0x00040000, 0, 0, 0x466C6561, 0x33000000]
    return {"camera": struct.pack(f"<{len(quadlets)}I", *quadlets)}


def calibrations() -> dict:
    row = "[1, 0, 0, -0.5, 0, 1, 0, 0, 0, 0, 1, 0]"
    own = f"version: 1\nrig: {{name: tiny, baseline: 0.5}}\ncameras:\n  - {{name: left, {LENS}}}\n  - {{name: right, {LENS}, T_camera_left: {row}}}\n"
    camera = "  camera_model: pinhole\n  intrinsics: [80, 80, 48, 36]\n  distortion_model: radtan\n  distortion_coeffs: [0, 0, 0, 0]\n  resolution: [96, 72]\n"
    kalibr = f"cam0:\n{camera}  rostopic: /left/image_raw\ncam1:\n{camera}  rostopic: /right/image_raw\n"
    kalibr += "  T_cn_cnm1:\n  - [1, 0, 0, -0.5]\n  - [0, 1, 0, 0]\n  - [0, 0, 1, 0]\n  - [0, 0, 0, 1]\n"

    def matrix(name: str, rows: int, columns: int, values: str, tag: str = "") -> str:
        return f"{name}:{tag}\n  rows: {rows}\n  cols: {columns}\n" + ("  dt: d\n" if tag else "") + f"  data: [{values}]\n"

    lens, eye = "80, 0, 48, 0, 80, 36, 0, 0, 1", "1, 0, 0, 0, 1, 0, 0, 0, 1"
    ros = ["image_width: 96\nimage_height: 72\ncamera_name: c\ndistortion_model: plumb_bob\n" + matrix("camera_matrix", 3, 3, lens) +
           matrix("distortion_coefficients", 1, 5, "0, 0, 0, 0, 0") + matrix("rectification_matrix", 3, 3, eye) +
           matrix("projection_matrix", 3, 4, f"80, 0, 48, {tx}, 0, 80, 36, 0, 0, 0, 1, 0") for tx in (0, -40)]
    tag = " !!opencv-matrix"
    opencv = ["%YAML:1.0\n---\n" + "".join(matrix(f"M{k}", 3, 3, lens, tag) + matrix(f"D{k}", 1, 5, "0, 0, 0, 0, 0", tag) for k in (1, 2)),
              "%YAML:1.0\n---\n" + matrix("R", 3, 3, eye, tag) + matrix("T", 3, 1, "-0.5, 0, 0", tag)]
    return {"own": own.encode(), "kalibr": kalibr.encode(), "ros": END.join(t.encode() for t in ros), "opencv": END.join(t.encode() for t in opencv)}


def other_calibrations() -> dict:
    okvis = "  - {T_SC: [0, -1, 0, 0, 1, 0, 0, %s, 0, 0, 1, 0, 0, 0, 0, 1], image_dimension: [96, 72], distortion_coefficients: [0, 0, 0, 0],\n"
    okvis += "     distortion_type: radialtangential, focal_length: [80, 80], principal_point: [48, 36]}\n"
    orb = "".join(f"Camera{k}.{key}: {value}\n" for k in (1, 2) for key, value in (("fx", 80.0), ("fy", 80.0), ("cx", 48.0), ("cy", 36.0), ("k1", 0.1)))
    ini = "[left]\nfx=80\nfy=80\ncx=48\ncy=36\nk1=0\n[right]\nfx=80\nfy=80\ncx=48\ncy=36\nk1=0\n[size]\nwidth=96\nheight=72\nbaseline=0.5\n"
    xml = "<?xml version=\"1.0\"?>\n<opencv_storage><M1 type_id=\"opencv-matrix\"><rows>3</rows><cols>3</cols><data>80 0 48 0 80 36 0 0 1</data></M1></opencv_storage>"
    json = '{"K1": [[80, 0, 48], [0, 80, 36], [0, 0, 1]], "D1": [0, 0, 0, 0], "K2": [[80, 0, 48], [0, 80, 36], [0, 0, 1]], "D2": [0, 0, 0, 0], "R": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "T": [[-0.5], [0], [0]], "size": [96, 72]}'
    texts = {"okvis": "%YAML:1.0\ncameras:\n" + okvis % 0 + okvis % 0.5, "orbslam": "%YAML:1.0\n" + orb + "Camera.width: 96\nCamera.height: 72\nStereo.b: 0.5\n",
             "ini": ini, "xml": xml, "json": json, "kitti": "P0: 80 0 48 0 0 80 36 0 0 0 1 0\nP1: 80 0 48 -40 0 80 36 0 0 0 1 0\n"}
    return {name: text.encode() for name, text in texts.items()}


def texts() -> dict:
    pose, matrix = "1 2 3 0 0 0.6 0.8", "1 0 0 1 0 1 0 2 0 0 1 3"
    stamps = [1403636579763555584 + i * 50000000 for i in range(4)]
    forms = {"tum": "{s} {p}", "ns": "{ns} {p}", "vins": "{ns},1,2,3,0.8,0,0,0.6,", "semicolons": "{c};1;2;3;0;0;0,6;0,8", "matrix": "{m}", "counted": "{i} {m}",
             "date": "2014-06-24 18:29:0{i}.5 {p}", "parts": "{sec} {nsec} {p}", "index": "{i} {s} {p} 7", "nan": "{s} nan nan nan 0 0 0 0",
             "times": "{ns}", "named": "{ns},{i}.png", "name_first": "{i}.png {s}", "both": "{s} left/{i}.png {s} right/{i}.png"}
    heads = {"head": "timestamp,x,y,z,qw,qx,qy,qz\n", "euroc": "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n"}
    line = lambda form, i: form.format(i=i, ns=stamps[i], sec=stamps[i] // 10**9, nsec=stamps[i] % 10**9, s=f"{stamps[i] // 10**9}.{stamps[i] % 10**9:09d}",  # noqa: E731
                                       c=f"{i},5", p=pose, m=matrix)
    out = {name: "".join(line(form, i) + "\n" for i in range(4)).encode() for name, form in forms.items()}
    return out | {name: head.encode() + out["vins"] for name, head in heads.items()}


def data_sets() -> dict:
    """The layouts of data_set.cpp, in its order: a byte for the format, then the files."""
    calibration = calibrations()["own"]
    tum, poses = b"0.0 0 0 0 0 0 0 1\n0.1 0 0 0.5 0 0 0 1\n", b"1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 0.5\n"
    p = [f"P{k}: 80 0 48 {-40 * k} 0 80 36 0 0 0 1 0\n" for k in range(2)]
    stamps = b"#timestamp [ns],filename\n1403636579763555584,1.png\n1403636579863555584,2.png\n"
    sensor = ("sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [0.0, -1.0, 0.0, 0.1, 1.0, 0.0, 0.0, %s, 0.0, 0.0, 1.0, 0.3, 0.0, 0.0, 0.0, 1.0]\n"
              "rate_hz: 20\nresolution: [96, 72]\ncamera_model: pinhole\nintrinsics: [80, 80, 48, 36]\ndistortion_model: radial-tangential\n"
              "distortion_coefficients: [0, 0, 0, 0]\n")
    truth = b"#timestamp,p,q\n1403636579763555584,0,0,0,1,0,0,0\n1403636579863555584,0,0,0.5,1,0,0,0\n"
    clock = b"2011-09-26 13:02:25.594360375\n2011-09-26 13:02:25.694360375\n"
    camera = "".join(f"S_0{k}: 96 72\nK_0{k}: 80 0 48 0 80 36 0 0 1\nD_0{k}: 0 0 0 0 0\nR_0{k}: 1 0 0 0 1 0 0 0 1\nT_0{k}: {-0.5 * k} 0 0\n"
                     f"S_rect_0{k}: 96 72\nR_rect_0{k}: 1 0 0 0 1 0 0 0 1\nP_rect_0{k}: 80 0 48 {-40 * k} 0 80 36 0 0 0 1 0\n" for k in range(2))
    rigid = b"calib_time: 25-May-2012 16:47:16\nR: 1 0 0 0 1 0 0 0 1\nT: 0 0 0\n"
    oxts = b"49.01 8.43 112.8 0.03 0.01 -0.9 -3.2 4.8 5.7 0 0 0 0 9.81 0 0 9.81 0 0 0 0 0 0 0.03 0.02 4 9 5 5 5\n"
    log = b"sec0 usec0 width0 height0 format0 sec1 usec1 width1 height1 format1 path0 path1\n"
    log += b"".join(b"1200000000 %d 96 72 GBRG8 1200000000 %d 96 72 GBRG8 200101_100000_MultiCamera0/a%d.bmp b%d.bmp\n" % (t, t, t, t) for t in (5, 100005))
    ins = b"".join(b"1200000000 %d -27.5 153.0 60 20 1 0 0 0.01 0.02 0.5\n" % t for t in (5, 100005))
    files = [[b"0.0\n0.1\n", calibration, tum, poses], ["".join(p).encode(), b"0.0\n0.1\n", poses],
             [stamps, stamps, (sensor % "0.0").encode(), (sensor % "0.5").encode(), truth],
             [camera.encode(), rigid, rigid, clock, clock, clock, oxts, oxts], [log, ins]]
    return {f"format{i}": bytes([i]) + END.join(texts) for i, texts in enumerate(files)}


def bmp(bits: int) -> bytes:
    palette = b"".join(bytes([i, i, i, 0]) for i in range(256)) if bits == 8 else b""
    begin, pixels = 54 + len(palette), bytes(3 * ((4 * bits + 31) // 32 * 4))
    return b"BM" + struct.pack("<IHHI", begin + len(pixels), 0, 0, begin) + struct.pack("<IiiHHIIiiII", 40, 4, 3, 1, bits, 0, len(pixels), 0, 0, 0, 0) + palette + pixels


def recordings(program: str, examples: Path) -> dict:
    with tempfile.TemporaryDirectory() as folder:
        session = Path(folder) / "s"
        settings = [w for k in range(2) for w in ("--set", f"cameras.{k}.size=[64, 64]")]
        done = subprocess.run([program, "run", examples / "mock.yaml", "--fast", "--quiet", "--duration", "0.2", "--out", session, *settings,
                               "--set", "mock.texture_detail=0", "--set", "record=[poses, ins, images]"], capture_output=True)
        file = session / "drive.mcap"
        if not file.exists():
            sys.exit(f"no recording of the mock: {done.stderr.decode()}")
        return {"mock": file.read_bytes()}


def main() -> int:
    program, examples, out = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
    with tempfile.TemporaryDirectory() as folder:
        write_bags(Path(folder) / "bags")
        bags = {p.name: p.read_bytes() for p in (Path(folder) / "bags").iterdir()}
    configurations = {p.name: p.read_bytes() for p in examples.glob("*.yaml")}
    corpora = {"xbus": xbus(), "gnss": gnss(), "trigger": {"script": bytes(range(256))}, "iidc_rom": rom(),
               "image_file": {"grey.png": png(16, 12, 1), "grey.pgm": b"P5 4 3 255\n" + bytes(12), "deep.ppm": b"P6\n# c\n2 2\n65535\n" + bytes(24),
                                                                   "grey.bmp": bmp(8), "colour.bmp": bmp(24), "alpha.bmp": bmp(32)}, "configuration": configurations,
               "calibration": calibrations() | other_calibrations(), "text_readers": texts(), "data_set": data_sets(), "bag": bags, "recording": recordings(program, examples)}
    for target, inputs in corpora.items():
        folder = out / f"{target}_fuzz"
        folder.mkdir(parents=True, exist_ok=True)
        for name, data in inputs.items():
            (folder / name).write_bytes(data)
    return 0


if __name__ == "__main__":
    sys.exit(main())
