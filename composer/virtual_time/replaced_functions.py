"""Replaces functions and methods that are written in C, for all who refer to them already.

`from time import sleep` copies a reference, and so do default arguments and closures: to set
`time.sleep` anew would not reach them. What can be reached is the function object itself: its
method definition is replaced by one that calls a Python function (CPython's `methodobject.c`).
The type dictionary holds what a method is; a proxy refers to it, and only hides it.
"""

from __future__ import annotations

import ctypes
import gc
from types import BuiltinFunctionType
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Callable

_api = ctypes.pythonapi


class _MethodDef(ctypes.Structure):
    _fields_ = (
        ('name', ctypes.c_char_p),
        ('function', ctypes.c_void_p),
        ('flags', ctypes.c_int),
        ('doc', ctypes.c_char_p),
    )


class _BuiltinFunction(ctypes.Structure):
    """A `PyCFunctionObject` of CPython 3.10 to 3.13."""

    _fields_ = (
        ('reference_count', ctypes.c_ssize_t),
        ('type', ctypes.c_void_p),
        ('definition', ctypes.c_void_p),
        ('owner', ctypes.c_void_p),
        ('module', ctypes.c_void_p),
        ('weak_references', ctypes.c_void_p),
        ('vectorcall', ctypes.c_void_p),
    )


_VARARGS_KEYWORDS: Final = 0x1 | 0x2
# Calls its first argument, a Python function, with what a builtin of that kind is given.
_CALLER: Final = ctypes.cast(_api.PyObject_Call, ctypes.c_void_p).value
_api.PyCFunction_NewEx.restype = ctypes.py_object
_api.PyCFunction_NewEx.argtypes = (ctypes.POINTER(_MethodDef), ctypes.py_object, ctypes.c_void_p)


# Method definitions, which must outlive the functions that are made of them.
_kept: list[_MethodDef] = []


class ReplacedFunction:
    """A builtin function that calls a Python function instead, wherever it is referred to.

    Args:
        builtin: A function of a module, as `time.sleep`. One in Python is what a test has patched
            it with, and stays.

    Attributes:
        original: A function that does what the builtin did.
    """

    def __init__(self, builtin: Any) -> None:
        self.original: Any = builtin
        self._is_builtin = isinstance(builtin, BuiltinFunctionType)
        if not self._is_builtin:
            return
        self._object = _BuiltinFunction.from_address(id(builtin))
        self._definition = self._object.definition
        self._owner, self._vectorcall = self._object.owner, self._object.vectorcall
        self._replacement: Any = None
        before = _MethodDef.from_address(self._definition)
        self._copy = _MethodDef(before.name, before.function, before.flags, before.doc)
        _kept.append(self._copy)
        module = ctypes.cast(self._owner, ctypes.py_object).value if self._owner else None
        self.original = _api.PyCFunction_NewEx(
            ctypes.pointer(self._copy), ctypes.py_object(module), None
        )

    def replace(self, function: Callable[..., Any]) -> None:
        """Have `function` called, with the same arguments."""
        if not self._is_builtin:
            return
        calling = _MethodDef(self._copy.name, _CALLER, _VARARGS_KEYWORDS, self._copy.doc)
        self._replacement = (function, calling)
        # The owner is what C functions get as their first argument.
        self._object.owner = id(function)
        self._object.definition = ctypes.addressof(calling)
        # Without it, a call is made as the flags of the definition say.
        self._object.vectorcall = None

    def restore(self) -> None:
        """Undo `replace`."""
        if self._is_builtin:
            self._object.definition = self._definition
            self._object.owner, self._object.vectorcall = self._owner, self._vectorcall


class ReplacedMethod:
    """A method of a type of C that is a Python function instead.

    Attributes:
        original: What the type had, as the type's dictionary has it.
    """

    def __init__(self, owner: type, name: str) -> None:
        self._owner, self._name = owner, name
        self._dictionary: dict[str, Any] = gc.get_referents(owner.__dict__)[0]
        self.original: Any = self._dictionary[name]

    def replace(self, function: Any) -> None:
        """Let `function`, or any descriptor, be the method."""
        self._set(function)

    def restore(self) -> None:
        """Undo `replace`."""
        self._set(self.original)

    def _set(self, method: Any) -> None:
        self._dictionary[self._name] = method
        _api.PyType_Modified(ctypes.py_object(self._owner))
