"""Small files that declare, or unpack to, far more than a computer's memory holds."""

import io
import struct
import zipfile
import zlib

import numpy as np

MAIN = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
RELATIONS = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
PACKAGE = "http://schemas.openxmlformats.org/package/2006"
HEAD = '<row r="1">{}</row>'.format(
    "".join(
        f'<c r="{column}1" t="inlineStr"><is><t>{name}</t></is></c>'
        for column, name in zip("AB", ("t", "vt"), strict=True)
    )
)
SAMPLES = "".join(
    f'<row r="{at + 2}"><c r="A{at + 2}"><v>{at / 100}</v></c><c r="B{at + 2}"><v>1</v></c></row>'
    for at in range(50)
)
OFFICE = "urn:oasis:names:tc:opendocument:xmlns:"
UNPACKED = 3 << 30  # bytes
VALUES = 1 << 27  # which as float64 are a gigabyte


def xlsx(rows=HEAD + SAMPLES, shared=None, method=zipfile.ZIP_DEFLATED):
    """Return a workbook whose sheet has these rows, XML or an iterable of it."""
    parts = {
        "[Content_Types].xml": f'<Types xmlns="{PACKAGE}/content-types"/>',
        "_rels/.rels": f'<Relationships xmlns="{PACKAGE}/relationships"><Relationship Id="r1" '
        f'Type="{RELATIONS}/officeDocument" Target="xl/workbook.xml"/></Relationships>',
        "xl/_rels/workbook.xml.rels": f'<Relationships xmlns="{PACKAGE}/relationships">'
        f'<Relationship Id="r1" Type="{RELATIONS}/worksheet" Target="worksheets/sheet1.xml"/>'
        "</Relationships>",
        "xl/workbook.xml": f'<workbook xmlns="{MAIN}" xmlns:r="{RELATIONS}"><sheets>'
        '<sheet name="Data" sheetId="1" r:id="r1"/></sheets></workbook>',
    }
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", method, compresslevel=1) as book:
        for name, text in parts.items():
            book.writestr(name, text)
        if shared is not None:
            _write(book, "xl/sharedStrings.xml", f'<sst xmlns="{MAIN}">', shared, "</sst>")
        head = f'<worksheet xmlns="{MAIN}"><sheetData>'
        _write(book, "xl/worksheets/sheet1.xml", head, rows, "</sheetData></worksheet>")
    return stream.getvalue()


def _write(book, name, head, content, tail):
    with book.open(name, "w", force_zip64=True) as file:
        file.write(head.encode())
        for part in (content,) if isinstance(content, str) else content:
            file.write(part.encode())
        file.write(tail.encode())


def xlsx_of_one_far_cell(cell="XFD1048576"):
    """Return a workbook with one number in the last cell that Excel has."""
    row = cell.lstrip("ABCDEFGHIJKLMNOPQRSTUVWXYZ")
    return xlsx(f'{HEAD}{SAMPLES}<row r="{row}"><c r="{cell}"><v>1</v></c></row>')


def xlsx_of_rows_without_cell_names():
    """Return a workbook of a wide and of a far row, whose cells do not say where they are."""
    wide = "<c><v>1</v></c>" * 16384
    return xlsx(f'{HEAD}<row r="2">{wide}</row><row r="1048576"><c><v>1</v></c></row>')


def xlsx_of_blanks():
    """Return a workbook that unpacks to gigabytes of blanks."""
    return xlsx([HEAD, SAMPLES, *[" " * (1 << 20)] * (UNPACKED >> 20)])


def xlsx_of_repeated_text():
    """Return a workbook whose cells all show the same long text, which it holds once."""
    shared = f"<si><t>{'x' * (1 << 20)}</t></si>"
    cells = (
        f'<row r="{at}"><c r="A{at}"><v>1</v></c><c r="B{at}"><v>1</v></c>'
        f'<c r="C{at}" t="s"><v>0</v></c></row>'
        for at in range(2, UNPACKED >> 20)
    )
    return xlsx([HEAD, *cells], shared)


def _declaring(data, size):
    """Return a workbook whose directory gives its sheet another size."""
    data = bytearray(data)
    entry = data.rfind(b"PK\x01\x02", 0, data.rfind(b"xl/worksheets/sheet1.xml"))
    struct.pack_into("<I", data, entry + 24, size)
    return bytes(data)


def xlsx_that_declares():
    """Return a workbook whose sheet declares gigabytes, though it has less."""
    return _declaring(xlsx(), UNPACKED)


def xlsx_that_lies():
    """Return a workbook whose sheet declares a few bytes, though it has more."""
    return _declaring(xlsx([HEAD, SAMPLES, " " * (1 << 24)]), 1000)


def xlsx_of_a_far_cell_behind_others():
    """Return a workbook of many rows, and a far cell whose tag is written in another way."""
    rows = (
        f'<row r="{at}"><c r="A{at}"><v>{at}</v></c><c r="B{at}"><v>1</v></c></row>'
        for at in range(2, 20_000)
    )
    far = "<row><x:c s='1' spans=\">\" r = 'xfd1048576' ><v>1</v></x:c></row>"
    return xlsx([HEAD, *rows, far])


def ods(rows):
    """Return an OpenDocument spreadsheet of these rows."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as book:
        kind = "application/vnd.oasis.opendocument.spreadsheet"
        book.writestr("mimetype", kind, zipfile.ZIP_STORED)  # as programs recognise it
        book.writestr(
            "content.xml",
            f'<office:document-content xmlns:office="{OFFICE}office:1.0" '
            f'xmlns:table="{OFFICE}table:1.0" xmlns:text="{OFFICE}text:1.0"><office:body>'
            f'<office:spreadsheet><table:table table:name="Data">{rows}</table:table>'
            "</office:spreadsheet></office:body></office:document-content>",
        )
        book.writestr("META-INF/manifest.xml", "<manifest/>")
    return stream.getvalue()


def ods_number(value, repeated=1):
    """Return a cell of a spreadsheet."""
    return (
        f'<table:table-cell office:value-type="float" office:value="{value}" '
        f'table:number-columns-repeated="{repeated}"/>'
    )


def ods_of_repeats():
    """Return a spreadsheet of one cell, repeated in a hundred million places."""
    row = ods_number(1.5, 1000)
    return ods(f'<table:table-row table:number-rows-repeated="100000">{row}</table:table-row>')


def ods_of_blank_repeats():
    """Return a spreadsheet of blank cells up to a last one that is not."""
    blank = '<table:table-cell table:number-columns-repeated="16383"/>'
    rows = f'<table:table-row table:number-rows-repeated="1048575">{blank}</table:table-row>'
    return ods(f"{rows}<table:table-row>{blank}{ods_number(1.5)}</table:table-row>")


def _compound(stream):
    """Return an OLE compound file with one stream, Workbook."""
    stream = stream.ljust(-(-max(len(stream), 4096) // 512) * 512, b"\0")
    sectors = len(stream) // 512
    fat = [0xFFFFFFFD, 0xFFFFFFFE, *range(3, sectors + 2), 0xFFFFFFFE]
    fat += [0xFFFFFFFF] * (128 - len(fat))
    head = struct.pack(
        "<8s16sHHHHH6sIIIIIIIIII",
        b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", b"", 0x3E, 3, 0xFFFE, 9, 6, b"",
        0, 1, 1, 0, 4096, 0xFFFFFFFE, 0, 0xFFFFFFFE, 0, 0,
    )  # fmt: skip
    head += struct.pack("<109I", *([0xFFFFFFFF] * 109))
    head = head[:76] + struct.pack("<I", 0) + head[80:512]

    def entry(name, kind, child, start, size):
        text = name.encode("utf-16-le") + b"\0\0"
        return struct.pack(
            "<64sHBBIII16sIQQIQ",
            text, len(text), kind, 1, 0xFFFFFFFF, 0xFFFFFFFF, child, b"", 0, 0, 0, start, size,
        )  # fmt: skip

    root = entry("Root Entry", 5, 1, 0xFFFFFFFE, 0)
    book = entry("Workbook", 2, 0xFFFFFFFF, 2, len(stream))
    blank = struct.pack("<64sHBBIII16sIQQIQ", b"", 0, 0, 0, *[0xFFFFFFFF] * 3, b"", 0, 0, 0, 0, 0)
    return head + struct.pack("<128I", *fat) + root + book + blank * 2 + stream


def _biff(kind, content):
    return struct.pack("<HH", kind, len(content)) + content


def xls(cells=((0, 0, "t"), (0, 1, "vt"), (1, 0, 0.0), (1, 1, 1.0)), dimensions=None):
    """Return a workbook of Excel 97 with these cells: row, column, number or text."""
    start = _biff(0x809, struct.pack("<HHHHII", 0x600, 5, 0, 0, 0, 0))
    sheet = _biff(0x809, struct.pack("<HHHHII", 0x600, 0x10, 0, 0, 0, 0))
    if dimensions is not None:
        sheet += _biff(0x200, struct.pack("<IIHHH", 0, dimensions[0], 0, dimensions[1], 0))
    for row, column, value in cells:
        if isinstance(value, str):
            text = struct.pack("<HB", len(value), 0) + value.encode()
            sheet += _biff(0x204, struct.pack("<HHH", row, column, 0) + text)
        else:
            sheet += _biff(0x203, struct.pack("<HHHd", row, column, 0, value))
    sheet += _biff(0x0A, b"")
    name = struct.pack("<BB", 4, 0) + b"Data"
    at = len(start) + 4 + 6 + len(name) + 4
    bound = _biff(0x85, struct.pack("<IH", at, 0) + name)
    return _compound(start + bound + _biff(0x0A, b"") + sheet)


def xls_of_one_far_cell():
    """Return an .xls with a number in a far row and another in a far column."""
    return xls([(0, 0, "t"), (0, 1, "vt"), (1, 0, 0.0), (65535, 65535, 1.0)])


def xls_of_dimensions():
    """Return an .xls of four cells that declares the most rows and columns."""
    return xls(dimensions=(0xFFFFFFFF, 0xFFFF))


def _element(kind, content):
    padding = b"\0" * (-len(content) % 8)
    return struct.pack("<II", kind, len(content)) + content + padding


def mat_array(name, shape, content, kind=6, flags=0):
    """Return an array of a MATLAB file: its class, shape and what follows its name."""
    parts = _element(6, struct.pack("<II", kind | flags, 0))
    parts += _element(5, struct.pack(f"<{len(shape)}i", *shape)) + _element(1, name.encode())
    return struct.pack("<II", 14, len(parts) + len(content)) + parts + content


def mat(*arrays):
    """Return a MATLAB file of version 5 with these arrays."""
    head = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x100) + b"IM"
    return head + b"".join(arrays)


def compressed(array):
    """Return an array as MATLAB compresses it."""
    packed = zlib.compress(array, 1)
    return struct.pack("<II", 15, len(packed)) + packed


def _packed(head, block, count):
    """Return a compressed element of a head and a block that is there so many times."""
    press = zlib.compressobj(1)
    start = press.compress(head) + press.flush(zlib.Z_FULL_FLUSH)
    again = press.compress(block) + press.flush(zlib.Z_FULL_FLUSH)
    check = zlib.adler32(head)
    for _ in range(count):
        check = zlib.adler32(block, check)
    packed = start + again * count + b"\3\0" + struct.pack(">I", check)
    return struct.pack("<II", 15, len(packed)) + packed


TIME = mat_array("t", (50, 1), _element(9, (np.arange(50) / 100).tobytes()))


def mat_of_zeros():
    """Return a file of an array of doubles that are saved as bytes, and compressed."""
    count = VALUES
    head = mat_array("vt", (count, 1), b"")
    head = struct.pack("<II", 14, len(head) - 8 + 8 + count) + head[8:]
    head += struct.pack("<II", 2, count)
    return mat(TIME, _packed(head, b"\0" * (1 << 20), count >> 20))


def mat_of_text():
    """Return a file with a text of two thousand million characters, none of which it holds."""
    return mat(TIME, mat_array("note", (1, 2**31 - 1), _element(16, b""), kind=4))


def mat_of_empty_structs():
    """Return a file with a thousand million structs that have no fields."""
    fields = _element(5, struct.pack("<i", 32)) + _element(1, b"")
    return mat(TIME, mat_array("s", (2**30, 1), fields, kind=2))


def mat_of_sparse():
    """Return a file with a sparse matrix of huge dimensions and one number."""
    content = _element(5, b"\0" * 4) + _element(5, struct.pack("<2i", 0, 1))
    content += _element(9, struct.pack("<d", 1.0))
    return mat(TIME, mat_array("m", (2**31 - 1, 2**31 - 1), content, kind=5))


def mat4(rows, columns, content=b"", kind=0):
    """Return a MATLAB file of version 4 with one matrix."""
    return struct.pack("<5i", kind, rows, columns, 0, 2) + b"t\0" + content


def mat4_of_dimensions():
    """Return a file of version 4 that declares far more than it holds."""
    return mat4(2**31 - 1, 2**31 - 1)


def parquet(rows, columns=("t",), groups=1):
    """Return a Parquet file of columns that hold one number again and again."""
    import pyarrow as pa
    from pyarrow import parquet as files

    stream = io.BytesIO()
    schema = pa.schema([(name, pa.float64()) for name in columns])
    part = pa.table({name: np.zeros(rows // groups) for name in columns}, schema)
    with files.ParquetWriter(stream, schema, compression="zstd") as writer:
        for _ in range(groups):
            writer.write_table(part, row_group_size=len(part))
    return stream.getvalue()


def parquet_of_zeros():
    """Return a file with a column of more than a hundred million zeros."""
    return parquet(VALUES, groups=128)


ZSTD = b"\x28\xb5\x2f\xfd"  # with which what is packed so begins


def parquet_that_lies(unpacked=2**31 - 1, rows=1000):
    """Return a file whose page declares to unpack to far more than the footer states."""
    import pyarrow as pa
    from pyarrow import parquet as files

    stream = io.BytesIO()
    schema = pa.schema([pa.field(name, pa.float64(), nullable=False) for name in ("vt", "t")])
    table = pa.table({name: np.arange(float(rows)) for name in schema.names}, schema)
    files.write_table(table, stream, compression="zstd", use_dictionary=False)
    data = stream.getvalue()
    chunk = files.ParquetFile(stream).metadata.row_group(0).column(0)
    start = chunk.data_page_offset
    length = data.index(ZSTD, start) - start  # of the header of its only page
    packed = chunk.total_compressed_size - length
    sizes = b"".join(b"\x15" + varint(2 * size) for size in (0, unpacked, packed))
    values = b"\x2c\x15" + varint(2 * rows) + b"\x15\x00\x15\x06\x15\x06\x00"
    filled = length - len(sizes) - len(values) - 3  # of the statistics' room
    header = sizes + values + b"\xa8" + varint(filled) + bytes(filled) + b"\x00"
    assert len(header) == length
    return data[:start] + header + data[start + length :]


def varint(value):
    """Return a number of Thrift's compact protocol, seven bits in a byte."""
    digits = [value >> shift & 0x7F for shift in range(0, max(value.bit_length(), 1), 7)]
    return bytes([*(digit | 0x80 for digit in digits[:-1]), digits[-1]])


def text_of_columns(count=2 * 10**6, rows=2):
    """Return a text with one line of names, and lines of numbers, all very wide."""
    names = ",".join(["t", *(f"c{at}" for at in range(count - 1))])
    numbers = [f"{at},{','.join(['1'] * (count - 1))}" for at in range(rows)]
    return "\n".join([names, *numbers, ""]).encode()


def text_of_one_line(count=4 * 10**6):
    """Return a text that never ends its first line."""
    return b"1," * count


def text_of_a_huge_cell(size=1 << 24):
    """Return a text with a quoted cell of many bytes."""
    return b't,vt\n0,"' + b"1" * size + b'"\n1,1\n'
