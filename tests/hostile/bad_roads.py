# ruff: noqa: E501
# fmt: off

"""Tables of bad nets and route files; see `hostile` for what must come of each."""

from __future__ import annotations

from pathlib import Path

from tests.hostile.inputs import NET, ROUTES, SCENE, Bad, changed, edit, moved_out, put, recode, several, whole_file

HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
BOMB = "<!DOCTYPE r [<!ENTITY a0 'ha'>" + "".join(f"<!ENTITY a{k} '{f'&a{k - 1};' * 10}'>" for k in range(1, 12)) + "]>"
SCHEMA = 'xsi:noNamespaceSchemaLocation="http://sumo.dlr.de/xsd/{}.xsd"'


def xml_attacks(file: str, root: str, schema: str) -> list[Bad]:
    """What XML can do beyond holding data: a document type, entities, other files, other schemas, other encodings."""
    name = Path(file).name
    begin = f"<{root} "
    types = {
        "an entity bomb": BOMB,
        "an entity of a file": '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/hostname">]>',
        "an entity of the net": '<!DOCTYPE r [<!ENTITY x SYSTEM "http://127.0.0.1:1/x">]>',
        "an entity of a parameter": '<!DOCTYPE r [<!ENTITY % x SYSTEM "file:///etc/hostname"> %x;]>',
        "a document type of a file": '<!DOCTYPE r SYSTEM "file:///etc/hostname">',
        "a document type of the net": '<!DOCTYPE r SYSTEM "http://127.0.0.1:1/x.dtd">',
    }
    found = [Bad(f"{name}: {way}", edit(file, begin, text + begin), (name, "entities or a document type")) for way, text in types.items()]
    found += [
        Bad(f"{name}: {way}", edit(file, begin, f"<{root}>{inside}</{root}>" + begin), (name, "not readable XML"))
        for way, inside in (("two roots", ""), ("an entity that nobody declared", "&x;"), ("a tag that is not closed", "<edge>"))
    ]
    inside = {
        "an include": ('<include href="/etc/hostname"/>', "include"),
        "an inclusion of XML's own": ('<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="/etc/passwd" parse="text"/>', "include"),
        "a detector that writes": ('<inductionLoop id="d" lane="exit_0" pos="1" freq="1" file="/tmp/owned.xml"/>', "inductionLoop"),
        "an output": ('<edgeData id="d" file="owned.xml"/>', "edgeData"),
        "a timed event that writes": ('<timedEvent type="SaveTLSStates" source="x" dest="owned.xml"/>', "timedEvent"),
        "a rerouter of a file": ('<rerouter id="r" edges="exit" file="/etc/passwd"/>', "rerouter"),
        "a configuration": ("<configuration><output><log value='owned'/></output></configuration>", "configuration"),
        "a script": ("<script>alert(1)</script>", "script"),
        "an element of another world": ('<x:edge xmlns:x="urn:x"/>', "edge"),
    }
    found += [Bad(f"{name}: {way}", edit(file, f"</{root}>", f"{text}</{root}>"), (name, word, "is not understood here")) for way, (text, word) in inside.items()]
    schemas = ("file:///etc/passwd", "/etc/passwd", "http://127.0.0.1:1/x.xsd", "http://sumo.dlr.de/xsd/../../x.xsd", "http://sumo.dlr.de.evil.example/xsd/net_file.xsd")
    found += [Bad(f"{name}: the schema {each}", edit(file, SCHEMA.format(schema), f'xsi:noNamespaceSchemaLocation="{each}"'), (name, "names the schema")) for each in schemas]
    found += [
        Bad(f"{name}: a schema of a namespace", edit(file, SCHEMA.format(schema), 'xsi:schemaLocation="urn:x http://127.0.0.1:1/x.xsd"'), (name, "names the schema")),
        Bad(f"{name}: a default namespace", edit(file, begin, f'<{root} xmlns="urn:x" '), (name,)),
        Bad(f"{name}: a root of another name", put(file, HEAD + "<configuration/>"), (name, "configuration")),
        Bad(f"{name}: in UTF-16 as it says", lambda project: (project / file).write_bytes((project / file).read_text().replace("UTF-8", "UTF-16").encode("utf-16")), (name, "UTF-8")),
        Bad(f"{name}: in UTF-16 though it says UTF-8", recode(file, "utf-16"), (name, "UTF-8")),
        Bad(f"{name}: in UTF-7 as it says", edit(file, 'encoding="UTF-8"', 'encoding="UTF-7"'), (name, "UTF-7")),
        Bad(f"{name}: in an unknown encoding", edit(file, 'encoding="UTF-8"', 'encoding="rot13"'), (name, "rot13")),
        Bad(f"{name}: an attribute twice", edit(file, begin, f'<{root} a="1" a="2" '), (name, "duplicate attribute")),
        Bad(f"{name}: 100,000 elements in one another", edit(file, f"</{root}>", "<param>" * 100_000 + "</param>" * 100_000 + f"</{root}>"), (name,)),
        Bad(f"{name}: out of the folder by a link", moved_out(file), (name, "leads out of the scene's folder")),
    ]
    return found


NUMBERS = {"nan": "nan", "inf": "inf", "-inf": "-inf", "1e308": "huge", "-1": "negative", "0": "zero", "": "empty", "ten": "text", "1,0": "a comma", "0x10": "hexadecimal", "1_0": "underscores", "１０": "wide digits", "1e999": "beyond floating point", "9" * 400: "of 400 digits"}
LANE, EDGE = '<lane id="approach_1" index="1" speed="13.89" length="100.00" shape="0.00,-1.60 100.00,-1.60"/>', '<edge id="exit" from="taper" to="finish" priority="-1">'
LINK = '<connection from="approach" to="exit" fromLane="1" toLane="0" via=":taper_0_0" dir="s" state="M"/>'
LIT = LINK.replace("dir=", 'tl="taper" linkIndex="2" dir=')
INNER = '<connection from=":taper_0" to="exit" fromLane="0" toLane="0" dir="s" state="M"/>'


def lane_numbers(name: str, old: str) -> list[Bad]:
    return [
        Bad(f"merge.net.xml: a lane's {name} is {way}", edit(NET, LANE, LANE.replace(f'{name}="{old}"', f'{name}="{value}"')), ("merge.net.xml", f"lane approach_1.{name}"))
        for value, way in NUMBERS.items()
    ]


def light(name: str, *phases: tuple[str, str]) -> str:
    """The programme of a traffic light, with phases of a duration and a state."""
    inside = "".join(f'<phase duration="{duration}" state="{state}"/>' for duration, state in phases)
    return f'<tlLogic id="{name}" type="static" programID="0" offset="0">{inside}</tlLogic>'


NETS = [
    *whole_file(NET),
    *xml_attacks(NET, "net", "net_file"),
    *lane_numbers("length", "100.00"),
    *lane_numbers("speed", "13.89"),
    *(
        Bad(f"merge.net.xml: a lane's shape is {shape[:30]!r}", edit(NET, LANE, LANE.replace("0.00,-1.60 100.00,-1.60", shape)), ("merge.net.xml", "lane approach_1.shape"))
        for shape in ("", "0,0", "nan,nan 1,1", "0,-1.6 inf,-1.6", "0 1", "0,-1.6 here", "0,0,0,0 1,1,1,1", "1e308,0 -1e308,0", "0,0 0,0", "0,-1.6;100,-1.6", "&lt;b>", "0,-1.6 " + "9" * 400 + ",0")
    ),
    *(
        Bad(f"merge.net.xml: {way}", edit(NET, old, new), ("merge.net.xml", *words))
        for way, old, new, words in (
            ("a lane misspelt", LANE, LANE.replace("<lane", "<lan"), ("lan: is not understood", "'lane'")),
            ("an attribute misspelt", LANE, LANE.replace("speed=", "sped="), ("lane approach_1.speed",)),
            ("an attribute left out", LANE, LANE.replace('speed="13.89" ', ""), ("lane approach_1.speed",)),
            ("a lane without a name", LANE, LANE.replace('id="approach_1" ', ""), ("edge approach",)),
            ("a lane of another edge's name", LANE, LANE.replace('id="approach_1"', 'id="exit_0"'), ("edge approach",)),
            ("a lane of no width", LANE, LANE.replace("index=", 'width="0" index='), ("lane approach_1.width",)),
            ("a lane as wide as a town", LANE, LANE.replace("index=", 'width="5000" index='), ("lane approach_1.width",)),
            ("a lane for dragons", LANE, LANE.replace("index=", 'allow="bus dragons" index='), ("lane approach_1.allow", "dragons")),
            ("a lane to another lane's neighbour", LANE, LANE.replace("/>", '><neigh lane="nope"/></lane>'), ()),
            ("a param that names a file", LANE, LANE.replace("/>", '><param key="file" value="/tmp/owned"/></lane>'), ("lane approach_1.param", "files")),
            ("an edge from nowhere", EDGE, EDGE.replace("taper", "tapper"), ("edge exit.from", "'taper'")),
            ("an edge to nowhere", EDGE, EDGE.replace("finish", "finsh"), ("edge exit.to", "'finish'")),
            ("an edge without an end", EDGE, EDGE.replace(' to="finish"', ""), ("edge exit.to",)),
            ("an edge twice", EDGE, EDGE.replace('"exit"', '"approach"'), ("edge approach",)),
            ("a connection from nowhere", LINK, LINK.replace('from="approach"', 'from="aproach"'), ("connection from aproach to exit", "'approach_1'")),
            ("a connection from no lane", LINK, LINK.replace('fromLane="1"', 'fromLane="9"'), ("connection from approach to exit", "approach_9")),
            ("a connection over nowhere", LINK, LINK.replace(":taper_0_0", ":taper_9_9"), ("via", "':taper_0_0'")),
            ("a connection of no direction", LINK, LINK.replace('dir="s" ', ""), ("connection from approach to exit.dir", "missing")),
            ("a junction that goes round for ever", INNER, INNER.replace("dir=", 'via=":taper_0_0" dir='), ("lane :taper_0_0", "back to itself")),
            ("a junction nowhere", '<junction id="finish" type="dead_end" x="220.00"', '<junction id="finish" type="dead_end" x="nan"', ("junction finish",)),
            ("a junction of no kind", '<junction id="finish" type="dead_end"', '<junction id="finish" type="roundabout_of_doom"', ()),
            ("a junction of one coordinate", 'shape="220.00,-3.20 220.00,0.00"', 'shape="220.00 0.00"', ("junction finish.shape",)),
            ("a junction with a misspelt lane", 'incLanes="approach_0 approach_1"', 'incLanes="approach_0 aproach_1"', ("junction taper.incLanes", "'approach_1'")),
            ("a junction with a misspelt lane inside", 'intLanes=":taper_0_0"', 'intLanes=":tapper_0_0"', ("junction taper.intLanes", "':taper_0_0'")),
            ("a junction without lanes inside", ' intLanes=":taper_0_0"', '', ("junction taper.intLanes", "missing")),
            *(
                (f"{what} of {value!r}", old, new.format(value), (f"{key}: '{value}' is not an integer",))
                for value in ("-0.0", "nan", "1e400", "nope", " 1", "-1", "١")
                for what, old, new, key in (
                    ("a request", '<request index="0"', '<request index="{}"', "junction taper.request.index"),
                    ("a lane's index", 'id="approach_1" index="1"', 'id="approach_1" index="{}"', "lane approach_1.index"),
                    ("a connection from a lane", LINK, LINK.replace('fromLane="1"', 'fromLane="{}"'), "connection from approach to exit.fromLane"),
                    ("a connection's light", LINK, LIT.replace('"2"', '"{}"'), "connection from approach to exit.linkIndex"),
                )
                if (what, value) != ("a connection's light", "-1")  # netconvert writes it where no light rules
            ),
            ("an edge of no function", '<edge id=":taper_0" function="internal"', '<edge id=":taper_0" function="internl"', ("edge :taper_0.function", "'internal'")),
            ("a priority", EDGE, EDGE.replace("-1", "-0.0"), ("edge exit.priority", "not an integer")),
            ("a roundabout of misspelt edges", '<junction id="finish"', '<roundabout nodes="taper" edges="aproach"/><junction id="finish"', ("roundabout.edges", "'approach'")),
            ("foes that are too many", 'foes="0"', f'foes="{"0" * 500}"', ()),
            ("a boundary that is none", 'convBoundary="0.00,0.00,220.00,0.00"', 'convBoundary="a,b"', ("location.convBoundary",)),
            ("a country", LANE, LANE.replace("100.00,-1.60", "100.00,15000000.00"), ("too large",)),
            ("a light that runs a program", "<junction id=\"finish\"", '<tlLogic id="taper" type="hilvl" programID="0" offset="0"/><junction id="finish"', ()),
            ("a light that writes", "<junction id=\"finish\"", '<tlLogic id="t" type="actuated" programID="0" offset="0"><param key="file" value="/tmp/owned.xml"/></tlLogic><junction id="finish"', ("files",)),
        )
    ),
    *(
        Bad(f"merge.net.xml: {way}", several(edit(NET, LINK, LIT), edit(NET, '<junction id="finish"', logic + '<junction id="finish"')), ("merge.net.xml: tlLogic taper", *words))
        for way, logic, words in (
            ("a light without a programme", "", ("has no programme",)),
            ("a light whose programme is misspelt", light("tapper", ("30", "GGG")), ("has no programme", "did you mean 'tapper'")),
            ("a light without phases", light("taper"), ("no duration",)),
            ("a light whose phases take no time", light("taper", ("0", "GGG"), ("0", "rrr")), ("no duration",)),
            ("a light with a phase that leaves out a link", light("taper", ("30", "GGG"), ("30", "rr")), ("link 2", "2 states")),
        )
    ),
    Bad("merge.net.xml: no way on to the goal", edit(NET, LINK, ""), ("merge.rou.xml", "vehicle ego", "no connection")),
    Bad("merge.net.xml: no roads", put(NET, HEAD + '<net version="1.20"><location netOffset="0,0" convBoundary="0,0,1,1" origBoundary="0,0,1,1" projParameter="!"/></net>'), ("merge.net.xml", "no lane that cars may use")),
    Bad("merge.net.xml: footpaths alone", lambda project: (project / NET).write_text((project / NET).read_text().replace("<lane ", '<lane allow="pedestrian" ')), ("merge.net.xml", "no lane that cars may use")),
]

# --- routes -----------------------------------------------------------------------------------------------------------

EGO_CAR, THROUGH, END = '<vType id="ego_car" length="4.60"', '<route id="through" edges="approach exit"/>', "</routes>"
EGO_VEHICLE = '<vehicle id="ego" type="ego_car" route="through" depart="0"'


def flow(attributes: str, inside: str = '<route edges="approach exit"/>') -> str:
    return f'<flow id="more" type="person_car" {attributes}>{inside}</flow></routes>'


def type_numbers(name: str, old: str) -> list[Bad]:
    return [
        Bad(f"merge.rou.xml: a type's {name} is {way}", edit(ROUTES, f'{name}="{old}"', f'{name}="{value}"'), ("merge.rou.xml", name) if value else ("merge.rou.xml",))
        for value, way in NUMBERS.items()
    ]


def flow_numbers(name: str) -> list[Bad]:
    rest = "" if name in ("period", "probability", "vehsPerHour") else ' period="5"'
    return [
        Bad(f"merge.rou.xml: a flow's {name} is {way}", edit(ROUTES, END, flow(f'{name}="{value}"{rest}')), ("merge.rou.xml", f"flow more.{name}"))
        for value, way in NUMBERS.items()
        if not (name in ("begin", "probability", "number") and value == "0")
    ]


def other(attributes: str, edges: str = "approach exit") -> str:
    return f'<vehicle id="other" type="person_car" depart="1" {attributes}><route edges="{edges}"/></vehicle></routes>'


ROUTE_FILES = [
    *whole_file(ROUTES),
    *xml_attacks(ROUTES, "routes", "routes_file"),
    *type_numbers("length", "4.60"),
    *type_numbers("maxSpeed", "40"),
    *flow_numbers("period"),
    *flow_numbers("begin"),
    *flow_numbers("probability"),
    *changed(
        ROUTES,
        ("an element misspelt", "<route id", "<rout id", ("rout: is not understood", "'route'")),
        ("a trip to nowhere", END, '<trip id="t" depart="0" from="approach" to="exti"/></routes>', ("trip t", "'exit'")),
        ("a trip against the traffic", END, '<trip id="t" depart="0" from="exit" to="approach"/></routes>', ("trip t", "no route")),
        ("a trip from a zone", END, '<trip id="t" depart="0" fromTaz="1" toTaz="2"/></routes>', ("trip t", "zone", "od2trips")),
        ("a trip between junctions", END, '<trip id="t" depart="0" fromJunction="a" toJunction="b"/></routes>', ("trip.fromJunction", "edges")),
        ("a person beyond the road", END, '<person id="p" depart="0" departPos="900"><walk edges="exit"/></person></routes>', ("person p", "departPos 900", "90 m")),
        ("a passenger", END, '<person id="p" depart="0"><walk edges="exit"/><ride to="exit"/></person></routes>', ("person.ride: is not supported", "remove it")),
        ("a person without a walk", END, '<person id="p" depart="0"/></routes>', ("person p", "no walk")),
        ("a person at no time", END, '<person id="p" depart="triggered"><walk edges="exit"/></person></routes>', ("person p.depart", "'triggered'")),
        ("a person of a car's type", END, '<person id="p" type="ego_car" depart="0"><walk edges="exit"/></person></routes>', ("person p.type", "pedestrian")),
        ("a flow of persons without a rate", END, '<personFlow id="p" begin="0" end="9"><walk edges="exit"/></personFlow></routes>', ("personFlow p", "has no rate")),
        ("a container", END, '<containerFlow id="p" begin="0" period="9"/></routes>', ("containerFlow: containers",)),
        ("another file", END, '<include href="/etc/passwd"/></routes>', ("include: is not understood here", "copy")),
        ("an arrival beyond the road", END, other('arrivalPos="3000"'), ("vehicle other.arrivalPos", "90 m")),
        ("a departure without SUMO's checks", END, other('insertionChecks="none"'), ("vehicle.insertionChecks", "'none'")),
        ("a stop off the route", END, other("", "approach").replace("<route", '<stop lane="exit_0" duration="5"/><route'), ("vehicle other.stop", "'exit'")),
        ("a stop off the road", END, other("").replace("<route", '<stop lane="exit_0" endPos="900" duration="5"/><route'), ("vehicle other.stop", "90 m")),
        ("a stop on no lane", END, other("").replace("<route", '<stop lane="exit_7" duration="5"/><route'), ("vehicle other.stop", "no lane 7")),
        ("a stop for ever", END, other("").replace("<route", '<stop lane="exit_0"/><route'), ("vehicle other", "duration")),
        ("a stop for a person", END, other("").replace("<route", '<stop lane="exit_0" triggered="true"/><route'), ("stop.triggered",)),
        ("a stop at a bus stop of another file", END, other("").replace("<route", '<stop busStop="b" duration="5"/><route'), ("vehicle other", "bus stop 'b'")),
        ("a type without a name", '<vType id="ego_car"', "<vType", ("has no 'id'",)),
        ("a device that writes", "<route id", '<vType id="x"><param key="has.ssm.device" value="true"/></vType><route id', ("vType x.param", "has.ssm.device")),
        ("a device that reads", "<route id", '<vType id="x"><param key="device.fcd-replay.FILES" value="/etc/passwd"/></vType><route id', ("vType x.param",)),
        ("a type in a type", "<route id", '<vType id="x"><vType id="y"/></vType><route id', ("vType",)),
        ("an acceleration that is none", 'accel="3.0"', 'accel="fast"', ()),
        ("an unknown car-following model", EGO_CAR, EGO_CAR + ' carFollowModel="Bumper"', ()),
        ("an unknown class", EGO_CAR, EGO_CAR + ' vClass="pasenger"', ("vType ego_car.vClass", "'passenger'")),
        ("a mix of unknown types", "<route id", '<vTypeDistribution id="mix" vTypes="nope" probabilities="1"/><route id', ()),
        ("a player of a mix", EGO_VEHICLE, '<vTypeDistribution id="mix"><vType id="a"/></vTypeDistribution>' + EGO_VEHICLE.replace("ego_car", "mix"), ("vehicle ego.type",)),
        ("a type misspelt", EGO_VEHICLE, EGO_VEHICLE.replace("ego_car", "eggo_car"), ("vehicle ego", "'ego_car'")),
        ("a route misspelt", EGO_VEHICLE, EGO_VEHICLE.replace("through", "trough"), ("vehicle ego", "'through'")),
        ("no route", EGO_VEHICLE, EGO_VEHICLE.replace('route="through" ', ""), ("has no 'route'",)),
        ("a route of no edges", THROUGH, THROUGH.replace("approach exit", " "), ("its route has no edges",)),
        ("a route over a missing edge", THROUGH, THROUGH.replace("approach", "aproach"), ("vehicle ego", "'approach'")),
        ("a route over the junction's inside", THROUGH, THROUGH.replace("approach", ":taper_0"), ("vehicle ego",)),
        ("a route the wrong way round", THROUGH, THROUGH.replace("approach exit", "exit approach"), ("vehicle 'ego'", "exit")),
        ("a route that does not reach the goal", THROUGH, THROUGH.replace("approach exit", "approach"), ("vehicle 'ego'", "goal")),
        ("a route for ever round", THROUGH, THROUGH.replace("approach exit", "approach exit " * 1000), ("vehicle ego",)),
        ("a vehicle twice", '<vehicle id="non_ego"', '<vehicle id="ego"', ("vehicle ego", "stands twice")),
        ("a vehicle with a space for a name", END, other("").replace('"other"', '"o ther"'), ("vehicle.id",)),
        ("a vehicle with a line end in its name", END, other("").replace('"other"', '"o&#10;ther"'), ("vehicle.id", "\\n")),
        ("a vehicle with a name of a megabyte", END, other("").replace('"other"', f'"{"x" * 1_000_000}"'), ("vehicle.id",)),
        ("a vehicle of no time", EGO_VEHICLE, EGO_VEHICLE.replace('depart="0"', 'depart="soon"'), ("vehicle ego.depart", "'soon'")),
        ("a vehicle before time", EGO_VEHICLE, EGO_VEHICLE.replace('depart="0"', 'depart="-5"'), ("vehicle ego.depart", "'-5'")),
        ("another that starts beyond the road's end", END, other('departPos="4500"'), ("vehicle other.departPos", "100 m")),
        ("another that starts nowhere", END, other('departPos="anywhere"'), ("vehicle other.departPos", "random_free")),
        ("another on no lane", END, other('departLane="2"'), ("vehicle other.departLane", "0 to 1")),
        ("another on a lane misspelt", END, other('departLane="fre"'), ("vehicle other.departLane", "'free'")),
        ("another that starts too fast", END, other('departSpeed="80"'), ("vehicle other.departSpeed", "13.89")),
        ("another over what is not connected", END, other("", "exit approach"), ("vehicle other", "no connection")),
        ("another with a player's name", END, other("").replace('"other"', '"non_ego"'), ("non_ego", "twice")),
        ("a flow of no rate", END, flow('begin="0"'), ("flow more", "rate")),
        ("a flow of two rates", END, flow('period="5" vehsPerHour="7"'), ("flow more", "twice")),
        ("a flow that ends before it begins", END, flow('begin="5" end="4" period="1"'), ("flow more.end",)),
        ("a flow of a billion", END, flow('end="10" number="1000000000"'), ("flow more.number",)),
        ("a flow of half a vehicle", END, flow('end="10" number="0.5"'), ("flow more.number",)),
        ("a flow of a billion an hour", END, flow('vehsPerHour="1e9"'), ("flow more.vehsPerHour",)),
        ("a flow drawn from too many", END, flow('period="exp(500)"'), ("flow more.period", "exp(vehicles per second)")),
        ("a flow from nowhere", END, '<flow id="more" to="exit" period="5"/></routes>', ("flow more", "'from'")),
    ),
    Bad("merge.rou.xml: another that may not use the road", several(edit(ROUTES, END, other("").replace("person_car", "boat").replace("<vehicle", '<vType id="boat" vClass="ship"/><vehicle')), edit(NET, LANE, LANE.replace("index=", 'allow="passenger" index=')), edit(NET, '"approach_0" index', '"approach_0" allow="passenger" index')), ("merge.rou.xml", "SUMO can't load it", "'other'")),
    Bad("merge.rou.xml: another with the name of a role", several(edit(ROUTES, 'vehicle id="ego"', 'vehicle id="hero"'), edit(ROUTES, END, other("").replace('"other"', '"ego"')), edit(SCENE, 'vehicle = "ego"', 'vehicle = "hero"')), ("merge.rou.xml", "vehicle ego", "has the name of a player", "rename it")),
    Bad("merge.rou.xml: nobody at all", put(ROUTES, HEAD + "<routes/>"), ("scene.toml", "ego.vehicle", "no vehicle")),
]
