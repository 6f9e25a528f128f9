# SPDX-License-Identifier: Apache-2.0
"""Stand-in for NanoXplore's Python module: records every call, refuses what is not known of the real one.

Methods, arguments, options and their values: NanoXplore's pages on nxpython and public scripts for NG-MEDIUM. Unknown
method, wrong number or name of arguments, unknown option or value, missing source, a model, port or clock that is not
there, a generic that the top has not: an exception. Calls go to $NX_LOG as lines of JSON; the step named in $NX_FAIL
returns False; reports are copied from $NX_REPORTS, the timing report is $NX_TIMING, both with the names of the top.
"""
import json
import os
import pathlib
import re
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "scripts"))

from psweep_tools import vhdl  # noqa: E402

YES = {"Yes", "No"}
EFFORT = {"Low", "Medium", "High"}
OPTIONS = {
    "MappingEffort": EFFORT, "TimingDriven": YES, "DensityEffort": EFFORT, "RoutingEffort": EFFORT,
    "DefaultRAMMapping": {"AUTO", "RAM", "RF"}, "DefaultROMMapping": {"AUTO", "LUT", "RF", "RAM"},
    "DefaultFSMEncoding": {"Binary", "OneHot", "OneHotSafe", "OneHotSafeExtra"},
    "ManageAsynchronousReadPort": YES, "ManageUnconnectedOutputs": {"Error", "Ground", "Power"},
    "ManageUnconnectedSignals": {"Error", "Ground", "Power"}, "ManageUninitializedLoops": YES,
    "DisableDSPFullRecognition": YES, "DisableDSPAluOperator": YES, "DisableDSPPreOperator": YES,
    "DisableDSPRegisters": YES, "DisableRAMRegisters": YES, "DisableRAMAlternateForm": YES,
    "MergeRegisterToPad": {"Always", "Never", "Input", "Output"},
    "UnusedPads": {"Floating", "WeakPullUp", "WeakPullDown"},
}
DIRECTIVES = {"RAM": {"RAM", "RAM_ECC", "RF", "DFF"}, "ROM": {"LUT", "RF", "RAM"}, "ADD": {"DSP", "CY", "LUT"}}
PAD = {
    "location": r"IOB\d+_D\d\d[PN]\Z", "standard": r"(LVCMOS|SSTL|HSTL|LVDS)\Z", "drive": r"(2|4|8|16)mA\Z",
    "slewRate": r"(Slow|Medium|Fast)\Z", "weakTermination": r"(None|PullUp|PullDown)\Z", "registered": r"(I|O|IO)\Z",
}
VOLTAGES = {"1.5", "1.8", "2.5", "3.3"}


class Models(object):
    def __init__(self, pattern):
        self.pattern = pattern


def record(name, arguments, named=None):
    with open(os.environ["NX_LOG"], "a") as log:
        log.write(json.dumps([name, arguments, named or {}]) + "\n")


def getModels(pattern):
    return Models(pattern)


def getErrorCount():
    return 0


def createProject(folder):
    record("createProject", [folder])
    return Project(folder)


def need(condition, text):
    if not condition:
        raise RuntimeError("nxpython stand-in: " + text)


class Analyzer(object):
    def __init__(self, project):
        self.project = project

    def launch(self, settings):
        need(set(settings) <= {"conditions", "maximumSlack", "searchPathsLimit"}, "launch: {}".format(settings))
        need(settings.get("conditions") in {"worstcase", "typical", "bestcase"}, "launch: {}".format(settings))
        record("launch", [settings])
        text = pathlib.Path(os.environ["NX_TIMING"]).read_text()
        for clock in ("rx_clk", "tx_clk"):
            if clock in self.project.clocks:
                text = text.replace("mii_" + clock, clock)
        (self.project.logs / "Timing_Constraints_Report_Routed.timing").write_text(text)


class Project(object):
    """Has the methods that are known, and no others."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.logs = self.folder / "logsPython"
        self.logs.mkdir(parents=True, exist_ok=True)
        self.top, self.text, self.entities, self.clocks, self.done = None, "", {}, set(), []

    # --- project ---
    def setVariantName(self, variant, package=None):
        need(variant in {"NG-MEDIUM", "NG-MEDIUM-EMBEDDED", "NG-LARGE", "NG-ULTRA"}, "no device " + variant)
        record("setVariantName", [variant, package])

    def setTopCellName(self, library, cell):
        record("setTopCellName", [library, cell])
        self.top = cell

    def addFiles(self, library, files):
        for file in files:
            need(os.path.isfile(file), "no source " + file)
            design = vhdl.parse(pathlib.Path(file).read_text())
            declared = {entity.name: entity for entity in design.entities}
            for instance in design.instances:
                need(instance.entity in self.entities or instance.entity in declared,
                     "{} uses {} before it is there".format(file, instance.entity))
            self.entities.update(declared)
        record("addFiles", [library, files])

    def addParameters(self, parameters):
        need(self.top in self.entities, "no entity {}".format(self.top))
        known = [generic.name for generic in self.entities[self.top].generics]
        for name, value in parameters.items():
            need(name in known, "no generic " + name)
            need(isinstance(value, str) and re.match(r"-?\d+\Z", value), "{}={!r}".format(name, value))
        record("addParameters", [parameters])

    def setOptions(self, options):
        for name, value in options.items():
            need(name in OPTIONS, "no option " + name)
            need(value in OPTIONS[name], "{}: {}".format(name, value))
        record("setOptions", [options])

    def addMappingDirective(self, models, kind, target):
        need(isinstance(models, Models), "addMappingDirective: models")
        pattern = re.escape(models.pattern).replace(r"\*", ".*")
        need(any(re.match(pattern + r"\Z", entity) for entity in self.entities), "no model " + models.pattern)
        need(kind in DIRECTIVES and target in DIRECTIVES[kind], "addMappingDirective {} {}".format(kind, target))
        record("addMappingDirective", [models.pattern, kind, target])

    # --- pads ---
    def ports(self):
        found = {}
        for port in self.entities[self.top].ports:
            for bit in ["[{}]".format(i) for i in range(int(vhdl.width_of(port)))] if port.range else [""]:
                found[port.name + bit] = port.mode
        return found

    def addBanks(self, banks):
        for bank, settings in banks.items():
            need(re.match(r"IOB\d+\Z", bank) and set(settings) == {"voltage"} and settings["voltage"] in VOLTAGES,
                 "bank {}: {}".format(bank, settings))
        record("addBanks", [banks])

    def addPads(self, pads):
        ports = self.ports()
        for name, settings in pads.items():
            need(name in ports, "no port " + name)
            for key, value in settings.items():
                need(key in PAD and re.match(PAD[key], value), "pad {}: {}={}".format(name, key, value))
            need(settings.get("registered", "I" if ports[name] == "in" else "O") == ports[name][0].upper(),
                 "pad {}: registered".format(name))
        record("addPads", [pads])

    # --- time ---
    def target(self, text, known):
        match = re.match(r"(get\w+)\(([\w\[\]]+)\)\Z", text)
        need(match and match[1] in known, "no such query here: " + text)
        if match[1] in ("getPort", "getClockNet"):
            need(match[2] in self.ports(), "no port in " + text)
        else:
            need(match[2] in self.clocks, "no clock in " + text)

    def createClock(self, target, name, period, rising=0, falling=None):
        self.target(target, ("getClockNet", "getPort"))
        need(0 < period and 0 <= rising < period and (falling is None or rising < falling <= rising + period),
             "clock {}".format(name))
        self.clocks.add(name)
        record("createClock", [], {"target": target, "name": name, "period": period})

    def between(self, method, source, target, more):
        for text in (source, target):
            if text:
                self.target(text, ("getPort", "getRegistersByClock"))
        need(source or target, method + ": from anything to anything")
        record(method, [], dict(more, source=source, target=target))

    def setMaxDelay(self, source, target, delay):
        need(delay > 0, "setMaxDelay {}".format(delay))
        self.between("setMaxDelay", source, target, {"delay": delay})

    def setFalsePath(self, source, target):
        self.between("setFalsePath", source, target, {})

    def delay(self, method, direction, clock, clockMode, low, high, ports):
        self.target(clock, ("getClock",))
        self.target(ports, ("getPort",))
        need(self.ports()[ports[8:-1]] == direction, "{}: direction of {}".format(method, ports))
        need(clockMode in ("rise", "fall") and low <= high, "{} {}".format(method, ports))
        record(method, [], {"clock": clock, "min": low, "max": high, "ports": ports})

    def setInputDelay(self, clock, clockMode, min, max, ports):  # names of the real one
        self.delay("setInputDelay", "in", clock, clockMode, min, max, ports)

    def setOutputDelay(self, clock, clockMode, min, max, ports):
        self.delay("setOutputDelay", "out", clock, clockMode, min, max, ports)

    # --- steps ---
    def step(self, name, before):
        need(self.done == before, "{} after {}".format(name, self.done))
        record(name, [])
        self.done.append(name)
        return name != os.environ.get("NX_FAIL")

    def synthesize(self):
        need(self.clocks, "synthesize without a clock")
        return self.step("synthesize", [])

    def place(self):
        return self.step("place", ["synthesize"])

    def route(self):
        return self.step("route", ["synthesize", "place"])

    def save(self, file):
        need(file.endswith(".nym"), "save " + file)
        record("save", [file])

    def reportInstances(self):
        record("reportInstances", [])
        text = pathlib.Path(os.environ["NX_REPORTS"], "hierarchy.json").read_text()
        (self.logs / "hierarchy.json").write_text(text.replace("psweep_top", self.top[:-len("_pins")]))

    def createAnalyzer(self):
        record("createAnalyzer", [])
        return Analyzer(self)

    def generateBitstream(self, file):
        need("route" in self.done and file.endswith(".nxb"), "generateBitstream " + file)
        record("generateBitstream", [file])
        pathlib.Path(file).write_text("made by a stand-in\n")
