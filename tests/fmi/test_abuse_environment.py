"""Mistreatment by the environment: callbacks, names, places, log categories, floating-point modes, signals."""

from __future__ import annotations

import ctypes as c
import mmap
import urllib.parse

import pytest

from tests.fmi.raw import CO_SIMULATION, ERROR, OK, Allocate, Callbacks, Free, Logger, Slave
from tests.fmi.subjects import SIZE, STATES, SUBJECTS, Checks, refused

check = Checks()


def instantiate(subject, *, name=b"one", kind=CO_SIMULATION, guid="", location="", callbacks=None, visible=0, logging=1):
    guid = subject.fmu.guid.encode() if guid == "" else guid
    location = subject.fmu.location().encode() if location == "" else location
    return c.c_void_p(subject.fmu.library.fmi2Instantiate(name, kind, guid, location, callbacks, visible, logging))


def works(subject, component) -> None:
    """An instance made by hand: three steps as ever."""
    slave = object.__new__(Slave)
    slave.fmu, slave.messages, slave.component = subject.fmu, [], component
    assert component.value and subject.first_run(slave) == subject.alone
    slave.free()


# --- instances ---


@check(b" a", b"%s%n%n%n", b"x" * 100_000, b"\xff\xfe", b"a\nb", "ü".encode())
def names_of_every_kind(subject, slave, name):
    messages = []
    callbacks = Callbacks(Logger(lambda *told: messages.append(told)), Allocate(), Free(), None, None)
    works(subject, instantiate(subject, name=name, callbacks=c.byref(callbacks)))
    assert all(told[1] == name for told in messages) and messages


@check(None, b"", b" ", b" \t\n\v\f\r")
def no_name(subject, slave, name):
    """The standard asks for at least one character that is no white space."""
    texts = []
    callbacks = Callbacks(Logger(lambda *told: texts.append(told[4])), Allocate(), Free(), None, None)
    assert not instantiate(subject, name=name, callbacks=c.byref(callbacks)).value and len(texts) == 1 and b"name" in texts[0]


@check()
def two_instances_of_one_name(subject, slave):
    with Slave(subject.fmu, name="slave") as twin:
        assert subject.first_run(twin) == subject.first_run(slave) == subject.alone


@check(2, -1)
def another_kind_of_simulation(subject, slave, kind):
    other = Slave(subject.fmu, kind=kind)
    assert not other.component.value and len(other.errors) == 1


@check(None, b"", b"{", b"nonsense", b"%s%n", b"x" * 100_000, b"\xff\xff")
def a_wrong_guid(subject, slave, guid):
    assert not instantiate(subject, guid=guid).value


@check()
def a_guid_cut_short(subject, slave):
    guid = subject.fmu.guid.encode()
    for length in range(len(guid)):
        assert not instantiate(subject, guid=guid[:length]).value


@check(*range(8))
def callbacks_that_are_absent(subject, slave, present):
    """Logger, allocateMemory and freeMemory: each may be there or not."""
    libc = c.CDLL(None)
    callbacks = Callbacks(Logger(lambda *_: None) if present & 1 else Logger(), Allocate(), Free(), None, None)
    if present & 2:
        callbacks.allocate = c.cast(libc.calloc, Allocate)
    if present & 4:
        callbacks.free = c.cast(libc.free, Free)
    works(subject, instantiate(subject, callbacks=c.byref(callbacks)))


@check()
def no_callbacks(subject, slave):
    works(subject, instantiate(subject))


@check()
def no_memory(subject, slave):
    told = []
    callbacks = Callbacks(Logger(lambda *call: told.append(call)), Allocate(lambda *_: None), Free(lambda _: None), None, None)
    assert not instantiate(subject, callbacks=c.byref(callbacks)).value
    assert b"out of memory" in told[-1][4]


@check()
def memory_that_is_not_clean(subject, slave):
    kept = []

    def dirty(count, size):
        kept.append(c.create_string_buffer(b"\xa5" * (count * size), count * size))
        return c.addressof(kept[-1])

    callbacks = Callbacks(Logger(), Allocate(dirty), Free(lambda _: None), None, None)
    works(subject, instantiate(subject, callbacks=c.byref(callbacks)))


@check()
def callbacks_that_are_gone_after_instantiation(subject, slave):
    """The structure is the caller's, and may be on its stack."""
    logger = Logger(lambda *_: None)
    callbacks = Callbacks(logger, Allocate(), Free(), None, None)
    component = instantiate(subject, callbacks=c.byref(callbacks))
    c.memset(c.byref(callbacks), 0xFF, c.sizeof(callbacks))
    works(subject, component)


@check()
def the_environment_comes_back(subject, slave):
    seen = []
    callbacks = Callbacks(Logger(lambda environment, *_: seen.append(environment)), Allocate(), Free(), None, 0xABCDEF)
    works(subject, instantiate(subject, callbacks=c.byref(callbacks)))
    assert set(seen) == {0xABCDEF}


@check(0, 1, 2, -1)
def the_flags_may_be_anything(subject, slave, flag):
    works(subject, instantiate(subject, visible=flag, logging=flag))


@check(*STATES)
def a_free_in_every_state(subject, slave, state):
    other = Slave(subject.fmu, memory=True)
    subject.bring_to(other, state)
    other.save()
    other.free()
    assert not other.blocks


@check("GetReal", "Reset", "DoStep", "Terminate", "GetFMUstate", "SetDebugLogging", "CancelStep", "GetStatus", "GetDirectionalDerivative")
def no_instance(subject, slave, function):
    arguments = {"DoStep": [c.c_double(0), c.c_double(SIZE), 1]}.get(function, [None] * 6)
    assert getattr(subject.fmu.library, f"fmi2{function}")(None, *arguments) == ERROR
    subject.fmu.library.fmi2FreeInstance(None)


# --- places ---


@check("file://", "file:", "file:///", "file:////", "FILE://", "file://localhost", "")
def a_location_in_every_spelling(subject, slave, prefix):
    path = str(subject.fmu.folder / "resources")
    for spelled in (
        path,
        urllib.parse.quote(path),
        "".join(f"%{byte:02x}" for byte in path.encode()).replace("%2f", "/"),
        path + "/",
        path + "//",
    ):
        works(subject, instantiate(subject, location=(prefix + spelled).encode()))


@check(
    None,
    b"",
    b"file:",
    b"file://",
    b"file:///",
    b"%",
    b"%0",
    b"%00",
    b"file:%2",
    b"http://example.org/",
    b"x" * 100_000,
    b"%s%n%n",
    b"\xff",
    b"file:///nowhere",
    b"ftp:" + b"/" * 10_000,
)
def a_location_that_is_none(subject, slave, location):
    works(subject, instantiate(subject, location=location))  # the folder beside the library is the fallback


# --- logging ---


@check(*STATES)
def log_categories_at_any_time(subject, slave, state):
    subject.bring_to(slave, state)
    names = (c.c_char_p * 4)(b"logAll", b"logStatusError", b"logStatusWarning", b"logEvents")
    for on in (0, 1, 2):
        for count in range(5):
            assert slave.call("SetDebugLogging", on, c.c_size_t(count), names) == OK


@check(b"", b"logNonsense", b"LOGALL", b"%s%n", b"x" * 100_000, None)
def log_categories_that_are_none(subject, slave, name):
    refused(slave, slave.call("SetDebugLogging", 1, c.c_size_t(2), (c.c_char_p * 2)(b"logAll", name)))
    refused(slave, slave.call("SetDebugLogging", 1, c.c_size_t(1), None))


@check()
def every_log_line_is_finished_and_of_a_known_category(subject, slave):
    assert slave.call("SetDebugLogging", 1, c.c_size_t(0), None) == OK
    subject.first_run(slave)
    assert slave.step(-5.0, SIZE) == ERROR and slave.set("solver.method", "100%s%n") == ERROR
    assert slave.call("Reset") == OK
    known = {category.get("name") for category in subject.fmu.xml.iter("Category")}
    assert len(slave.messages) >= 3
    for _, category, text in slave.messages:
        assert category in known and text and text == text.strip() and "\n" not in text and text.isprintable()


# --- the processor's modes ---

FLUSH, TRAPS_OFF = 0x8040, 0x1F80
MODES = {
    "flush to zero": TRAPS_OFF | FLUSH,
    "downward": TRAPS_OFF | 0x2000,
    "upward": TRAPS_OFF | 0x4000,
    "to zero": TRAPS_OFF | 0x6000,
    "traps": 0x1100,
    "traps and flush": 0x1100 | FLUSH,
}


def control_register():
    """Returns (set, get, their memory): MXCSR by instructions of our own."""
    page = mmap.mmap(-1, 4096, prot=mmap.PROT_READ | mmap.PROT_WRITE | mmap.PROT_EXEC)
    page.write(b"\x0f\xae\x17\xc3".ljust(16, b"\x90") + b"\x0f\xae\x1f\xc3")  # ldmxcsr [rdi]; ret and stmxcsr [rdi]; ret
    address = c.addressof(c.c_char.from_buffer(page))
    load, store = (c.CFUNCTYPE(None, c.POINTER(c.c_uint))(address + offset) for offset in (0, 16))
    return load, store, page


@check(*MODES)
def another_mode_of_the_processor(subject, slave, mode):
    import platform

    if platform.machine() != "x86_64":
        pytest.skip("the modes of another processor")
    load, store, _page = control_register()
    wanted, found, usual = c.c_uint(MODES[mode]), c.c_uint(), c.c_uint(TRAPS_OFF)
    calls = [
        ("SetupExperiment", 0, c.c_double(0), c.c_double(0), 0, c.c_double(0)),
        ("EnterInitializationMode",),
        ("ExitInitializationMode",),
        *(("DoStep", c.c_double(k * SIZE), c.c_double(SIZE), 1) for k in range(3)),
    ]
    for name, *arguments in calls:
        function = getattr(subject.fmu.library, f"fmi2{name}")
        load(c.byref(wanted))
        status = function(slave.component, *arguments)
        store(c.byref(found))
        load(c.byref(usual))
        assert status == OK and found.value == wanted.value, "the master's modes and flags are as they were"
    assert slave.reals(subject.outputs) == subject.alone


@pytest.mark.parametrize("name", SUBJECTS)
@pytest.mark.parametrize("what", check.names)
def test_abuse_by_the_environment(subject, what, name):
    check.run(what, subject(name))
