"""Files of REXS, the Reusable Engineering EXchange Standard, as components, relations and load cases: XML, JSON or zip.

Files are not trusted: entities, external references and document types are refused, and sizes are bounded.
"""

import base64
import json
import json.scanner
import zipfile
from bisect import bisect_left
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any, cast
from xml.sax import SAXParseException
from xml.sax.handler import ContentHandler

import numpy as np

from fem.support.arguments import FilePath
from fem.support.validation import require, text_of

#: Versions that are read, in words; the structure of files is the same in all of them.
VERSIONS = "1.0 to 1.7 and 2.0"
#: Largest file and largest content of a zip archive [bytes], and most components and values of an array.
LARGEST_FILE, MOST_COMPONENTS, MOST_VALUES = 64 * 2**20, 100_000, 1_000_000
#: Types of numbers in arrays that are coded in base 64.
CODES = {"float32": "<f4", "float64": "<f8", "int32": "<i4"}
#: Keys of an attribute's value in JSON; those of arrays end with _array or _array_coded.
KINDS = "floating_point", "integer", "boolean", "string", "enum", "reference_component", "file_reference", "date_time"
#: Elements of XML files beside those that hold a component's values; and most others, by name, before it is refused.
ELEMENTS = "model", "relations", "ref", "components", "load_spectrum", "matrix", "array_of_arrays", "r"
MOST_UNKNOWN = 20
#: What is told of results over all load cases.
ACCUMULATION = "accumulation of the load cases, which holds results of another program"
#: Names under which a file inside a zip archive is a model.
SUFFIXES = ".rexs", ".xml", ".rexsj", ".json"


@dataclass(frozen=True, eq=False)
class Attribute:
    """Value of an attribute: a text, a number, True or False, or an array of numbers; with its unit and its line."""

    value: Any
    unit: str
    line: int


@dataclass(frozen=True, eq=False)
class Component:
    """A part of the model with its attributes by name, and the line where it begins."""

    id: str
    type: str
    name: str
    line: int
    attributes: dict[str, Attribute] = field(default_factory=dict)

    @property
    def title(self) -> str:
        """How messages name it."""
        name = f" {self.name!r}" if self.name else ""
        return f"{self.type} {self.id}{name}, line {self.line}"


@dataclass(frozen=True, eq=False)
class Relation:
    """Which components belong together: their ids by role, and the line where it begins."""

    type: str
    order: int
    roles: dict[str, str]
    line: int


@dataclass(frozen=True, eq=False)
class RexsFile:
    """Content of a file: components by id, relations, and the components whose attributes change in each load case.

    unread   parts of the file that are none of these, in words, such as results accumulated over its load cases
    """

    path: Path
    version: str
    application: str
    components: dict[str, Component]
    relations: tuple[Relation, ...]
    load_cases: tuple[dict[str, Component], ...]
    unread: tuple[str, ...] = ()

    def of_type(self, *types: str) -> list[Component]:
        """Components of some types, in the order of the file."""
        return [component for component in self.components.values() if component.type in types]

    def related(self, type: str, **roles: str) -> Iterator[Relation]:
        """Relations of a type in which components, by their ids, have the roles."""
        for relation in self.relations:
            if relation.type == type and all(relation.roles.get(role) == id for role, id in roles.items()):
                yield relation


def read_file(path: FilePath) -> RexsFile:
    """The content of a REXS file.

    Raises FileNotFoundError, and ValueError with the line for a file that is broken, too large, of another version or
    not a REXS file.
    """
    path = Path(path)
    require(path.is_file() or not path.exists(), f"{path} is not a file")
    size = path.stat().st_size
    require(size <= LARGEST_FILE, f"{path} has {size} bytes; files of up to {LARGEST_FILE} bytes are read")
    data = path.read_bytes()
    if data[:4] == b"PK\x03\x04":
        data = _unzipped(data, path)
    wide = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    require(not wide, f"{path} is coded in UTF-16; REXS files are read in UTF-8: save it so")
    content = data.removeprefix(b"\xef\xbb\xbf").lstrip()
    require(content[:1] in (b"<", b"{"), f"{path} holds neither XML nor JSON, so no REXS model; export it as REXS")
    model = _from_xml(content, path) if content[:1] == b"<" else _from_json(content, path)
    _check(model)
    return model


def _unzipped(data: bytes, path: Path) -> bytes:
    """The only model in a zip archive; further files, such as meshes, are not read."""
    try:
        with zipfile.ZipFile(BytesIO(data)) as archive:
            models = [entry for entry in archive.infolist() if _is_model(entry.filename)]
            listed = f"{path} holds {[entry.filename for entry in archive.infolist()]}"
            require(len(models) == 1, f"{listed}; a REXS archive holds one model {SUFFIXES}")
            too_large = f"{models[0].filename} in {path} has {models[0].file_size} bytes"
            require(models[0].file_size <= LARGEST_FILE, f"{too_large}; up to {LARGEST_FILE} bytes are read")
            with archive.open(models[0]) as file:
                content = file.read(LARGEST_FILE + 1)
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, EOFError) as error:
        raise ValueError(f"{path} is a broken or encrypted zip archive: {error}; export it again") from None
    require(len(content) <= LARGEST_FILE, f"the model in {path} is larger than {LARGEST_FILE} bytes")
    return content


def _is_model(name: str) -> bool:
    """Whether a file in an archive is a model by its name; macOS adds a file "__MACOSX/._name" beside each."""
    return name.lower().endswith(SUFFIXES) and not name.rpartition("/")[2].startswith("._")


def _from_xml(content: bytes, path: Path) -> RexsFile:
    # imported here, as most scripts read no file
    from defusedxml import DefusedXmlException
    from defusedxml.sax import parseString

    handler = _Handler(path)
    try:
        parseString(content, handler, forbid_dtd=True)
    except LookupError as error:
        raise ValueError(f"{path}: {error}; save it in UTF-8") from None
    except SAXParseException as error:
        where = f"line {error.getLineNumber()} of {path}"
        raise ValueError(f"{where} is no XML: {error.getMessage()}; export the file again") from None
    except DefusedXmlException:
        refused = "declares a document type or entities, which REXS has not and which are not read"
        raise ValueError(f"{path} {refused}; remove the declaration") from None
    return handler.model()


class _Handler(ContentHandler):
    """Components, relations and load cases of an XML file, with the lines where they begin."""

    _locator: Any

    def __init__(self, path: Path):
        super().__init__()
        self.path = path
        self.head: dict[str, str] | None = None
        self.components: dict[str, Component] = {}
        self.relations: list[Relation] = []
        self.load_cases: list[dict[str, Component]] = []
        self.unread: dict[str, None] = {}
        self.target = self.components
        self.component: Component | None = None
        self.relation: Relation | None = None
        self.attribute: tuple[str, str, int] | None = None
        self.text: list[str] = []
        self.cells: list[str] | None = None
        self.code = ""

    def startElement(self, name, attrs):
        line, given = self._locator.getLineNumber(), dict(attrs)
        where = f"line {line} of {self.path}"
        if name == "model":
            self.head = given
        require(self.head is not None, f"{where}: the root of a REXS file is <model>, got <{name}>")
        if name == "relation":
            self.relation = Relation(_given(given, "type", where), _order(given, where), {}, line)
        elif name == "ref" and self.relation is not None:
            self.relation.roles[_given(given, "role", where)] = _given(given, "id", where)
        elif name == "load_case":
            self.target = {}
            self.load_cases.append(self.target)
        elif name == "accumulation":
            self.target = {}
            self.unread[ACCUMULATION] = None
        elif name == "component":
            id = _given(given, "id", where)
            require(id not in self.target, f"{where}: a second component has the id {id}; export the file again")
            self.component = _component(id, given, where, line, self.components)
            self.target[id] = self.component
            many = f"{self.path} has more than {MOST_COMPONENTS} components"
            require(len(self.target) <= MOST_COMPONENTS, many)
        elif name == "attribute" and self.component is not None:
            self.attribute, self.text = (_given(given, "id", where), given.get("unit", ""), line), []
        elif name == "array":
            self.cells, self.code, self.text = [], given.get("code", ""), []
        elif name == "c":
            self.text = []
        elif name not in ELEMENTS:
            self.unread.setdefault(f"elements <{name}>, which REXS has not, the first in line {line}")
            require(len(self.unread) <= MOST_UNKNOWN, f"{where}: <{name}> is no element of REXS; export it as REXS")

    def characters(self, content):
        self.text.append(content)

    def endElement(self, name):
        text = "".join(self.text).strip()
        if name == "relation" and self.relation is not None:
            self.relations.append(self.relation)
            self.relation = None
        elif name == "c" and self.cells is not None:
            self.cells.append(text)
        elif name == "array" and self.code and self.attribute is not None:
            self.cells = [repr(x) for x in _decoded(text, self.code, f"line {self.attribute[2]} of {self.path}")]
        elif name == "attribute" and self.attribute is not None and self.component is not None:
            id, unit, line = self.attribute
            value = text if self.cells is None else _array(self.cells, f"{id} in line {line} of {self.path}")
            self.component.attributes[id] = Attribute(value, unit, line)
            self.attribute, self.cells, self.code = None, None, ""
        elif name in ("load_case", "accumulation"):
            self.target = self.components
        elif name == "component":
            self.component = None

    def model(self) -> RexsFile:
        head: dict[str, str] = self.head or {}
        application = f"{head.get('applicationId', '')} {head.get('applicationVersion', '')}".strip()
        relations, cases = tuple(self.relations), tuple(self.load_cases)
        version, unread = head.get("version", ""), tuple(self.unread)
        return RexsFile(self.path, version, application, self.components, relations, cases, unread)


def _given(attributes: Mapping, name: str, where: str) -> str:
    require(str(attributes.get(name, "")) != "", f"{where} lacks {name}; export the file again")
    return str(attributes[name])


def _component(id: str, given: Mapping, where: str, line: int, known: Mapping[str, Component]) -> Component:
    """A component without attributes; of a load case it may leave its type to the component of the model (known)."""
    of_model = known.get(id)
    if of_model is not None and not given.get("type"):
        return Component(id, of_model.type, of_model.name, line)
    return Component(id, _given(given, "type", where), given.get("name", ""), line)


def _order(attributes: Mapping, where: str) -> int:
    """Place of a part among those of a relation of its type."""
    order = str(attributes.get("order") or 0)
    require(order.isdigit(), f"{where}: the order of a relation must be a whole number, got {order!r}")
    return int(order)


def _decoded(text: str, code: str, where: str) -> list[float]:
    """Numbers that are coded in base 64, little-endian."""
    require(code in CODES, f"{where}: the code {code!r} of an array is not known; known are {list(CODES)}")
    try:
        values = np.frombuffer(base64.b64decode(text, validate=True), CODES[code])
    except ValueError as error:
        raise ValueError(f"{where}: the array is not coded as {code} in base 64: {error}") from None
    return values.astype(float).tolist()


def _array(cells: list, where: str) -> Any:
    """(n,) numbers, or the texts where they are none."""
    require(len(cells) <= MOST_VALUES, f"{where} has {len(cells)} values; up to {MOST_VALUES} are read")
    try:
        return np.array(cells, float)
    except (TypeError, ValueError):
        return list(cells)


class _JsonObject(dict):
    """An object of a JSON file with the line where it begins."""

    line: int | None = None


class _JsonWithLines(json.JSONDecoder):
    """Reads JSON objects as `_JsonObject`.

    Python's decoder in C tells no positions: that in Python, of the same module, is given another function for objects.
    """

    def __init__(self, text: str):
        super().__init__()
        self._ends_of_lines = [end for end, character in enumerate(text) if character == "\n"]
        plain, scanner = cast("Any", json.JSONDecoder()), cast("Any", json.scanner)
        self._without_line = plain.parse_object
        self.parse_object = self._object_with_line
        self.scan_once = scanner.py_make_scanner(self)

    def _object_with_line(self, text_and_begin, *options):
        pairs, end = self._without_line(text_and_begin, *options)
        content = _JsonObject(pairs)
        content.line = bisect_left(self._ends_of_lines, text_and_begin[1]) + 1
        return content, end


def _from_json(content: bytes, path: Path) -> RexsFile:
    try:
        text = content.decode("utf-8")
        root = _JsonWithLines(text).decode(text)
    except UnicodeDecodeError as error:
        raise ValueError(f"{path} is not coded in UTF-8: {error}; export it again") from None
    except json.JSONDecodeError as error:
        raise ValueError(f"line {error.lineno} of {path} is no JSON: {error.msg}; export the file again") from None
    except RecursionError:
        raise ValueError(f"{path} is nested too deeply for a REXS file") from None
    model: Any = root.get("model") if isinstance(root, dict) else None
    require(isinstance(model, dict), f"{path} has no 'model', so it is no REXS file")
    try:
        components = _components(model.get("components", ()), path)
        relations = tuple(
            Relation(
                str(relation["type"]),
                _order(relation, f"line {relation.line} of {path}"),
                {str(ref["role"]): str(ref["id"]) for ref in relation["refs"]},
                relation.line,
            )
            for relation in model.get("relations", ())
        )
        spectra = model.get("load_spectra") or [model.get("load_spectrum") or {}]
        cases = [case for spectrum in spectra for case in spectrum.get("load_cases", ())]
        load_cases = tuple(_components(case.get("components", ()), path, components) for case in cases)
    except (AttributeError, KeyError, TypeError) as error:
        raise ValueError(f"{path} has not the structure of a REXS file, at {error}; export it again") from None
    application = f"{model.get('applicationId', '')} {model.get('applicationVersion', '')}".strip()
    unread = (ACCUMULATION,) if any(spectrum.get("accumulation") for spectrum in spectra) else ()
    return RexsFile(path, str(model.get("version", "")), application, components, relations, load_cases, unread)


def _components(listed, path: Path, known: Mapping[str, Component] | None = None) -> dict[str, Component]:
    """Components by their ids; known: those of the model, whose types load cases need not repeat."""
    require(len(listed) <= MOST_COMPONENTS, f"{path} has more than {MOST_COMPONENTS} components")
    components: dict[str, Component] = {}
    for each in listed:
        where = f"line {each.line} of {path}"
        id = _given(each, "id", where)
        require(id not in components, f"{where}: a second component has the id {id}; export the file again")
        component = _component(id, each, where, each.line, known or {})
        for attribute in each.get("attributes", ()):
            line = attribute.line
            name = _given(attribute, "id", f"line {line} of {path}")
            value = _json_value(attribute, f"{name} in line {line} of {path}")
            component.attributes[name] = Attribute(value, attribute.get("unit") or "", line)
        components[id] = component
    return components


def _json_value(attribute: Mapping, where: str) -> Any:
    for key, value in attribute.items():
        if key in KINDS:
            return value if isinstance(value, bool) else str(value) if key != "floating_point" else value
        if key.endswith("_array_coded"):
            return np.array(_decoded(value["value"], value["code"], where))
        if key.endswith("_array"):
            return _array(value, where)
    return ""


def _check(model: RexsFile) -> None:
    """Require a known version, and relations to components that are there."""
    major, _, rest = model.version.partition(".")
    minor = rest.partition(".")[0]
    known = (major == "1" and minor.isdigit() and int(minor) <= 7) or (major == "2" and minor == "0")
    require(known, f"{model.path} has version {text_of(model.version)}; versions {VERSIONS} are read: export as one")
    for relation in model.relations:
        for role, id in relation.roles.items():
            where = f"line {relation.line} of {model.path}"
            missing = f"{where}: a relation {relation.type!r} names component {id} as {role}, which is not there"
            require(id in model.components, f"{missing}; export the file again")
