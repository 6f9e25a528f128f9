# SPDX-License-Identifier: Apache-2.0
"""The one reader of our VHDL: which files there are, in which order, and what they declare.

  Rtl("rtl")            files of rtl/files.f; the file of an entity; what it declares
  parse(text)           entities with generics and ports, assertions, instances, attributes, signals, constants
  tokens(text)          the words of a file, comments among them

It reads the VHDL-93 of this repository, not all of VHDL; what it does not understand is an error (VhdlError), nothing
gets lost. A test compares it with what GHDL reads."""
from .files import Rtl, essence, listed, uses
from .reader import (Assertion, Attribute, Design, Entity, Generic, Instance, Port, code_only, parse, range_of,
                     squeezed, width_of)
from .tokens import Token, VhdlError, tokens

__all__ = ["Assertion", "Attribute", "Design", "Entity", "Generic", "Instance", "Port", "Rtl", "Token", "VhdlError",
           "code_only", "essence", "listed", "parse", "range_of", "squeezed", "tokens", "uses", "width_of"]
