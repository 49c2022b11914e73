"""All that is used of Numba beyond what it documents: this file alone reaches into it.

A version of Numba may change any of it; `tests/compile/test_numba_private.py` names each part. Here
stand the compiler of parts, the dispatcher with two forms, and the cache in sealed files.

*Parts* are kernels that only kernels call: compiled to be part of what calls them, not to be run.
Numba optimises every function and makes machine code of it, and does both again where the function
is part of a caller, and of that one's caller. Here only what Python calls, or what is called by its
address, goes through that. What it calls is linked into it as it was lowered, but for the functions
that are always inlined.
"""

# ruff: noqa: F401  (names of Numba that others take from here)

import contextlib
import copy
import functools
import gc
import io
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
from llvmlite.ir import DoubleType, IntType, IRBuilder
from numba import types
from numba._dynfunc import make_function
from numba.core import cgutils, event, sigutils
from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    NullCache,
    UserProvidedCacheLocator,
)
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, CompileResult
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import register_pass
from numba.core.errors import NumbaError, UnsupportedBytecodeError
from numba.core.imputils import lower_getattr_generic, lower_setattr_generic
from numba.core.registry import CPUDispatcher
from numba.core.runtime import rtsys
from numba.core.typed_passes import NativeLowering, NativeParforLowering
from numba.core.typeinfer import register_dispatcher
from numba.core.typing.templates import (
    AbstractTemplate,
    AttributeTemplate,
    infer_getattr,
    infer_global,
    signature as signature_of,
)
from numba.core.utils import _dynamic_modname, _dynamic_module
from numba.cpython import numbers
from numba.experimental.function_type import _get_wrapper_address

from torquer.compile import sources, turns
from torquer.compile.code_cache import (
    FOLDER,
    READY,
    SOURCES,
    is_sound,
    names_the_folder,
    numba_config,
    seal_file,
    tell,
)
from torquer.compile.ready import GENERIC
from torquer.compile.references import References, naming_symbols
from torquer.compile.sources import is_own
from torquer.compile.when_compiling import FOR_KERNELS, LOOP_OPTIONS, numba_is_loaded

#: New objects after which Python looks for garbage while it compiles; usually 700, with which the
#: searches took 2.4 s of the 27 s that the main example compiles.
_NEW_OBJECTS = 100_000

numba_config()
# where code is at home whose module cannot be imported, such as a user's file: what the disk keeps
# of it asks for that
sys.modules.setdefault(_dynamic_modname, _dynamic_module)


class Part(JITCodeLibrary):
    """Code to be linked into other code."""

    def _optimize_final_module(self) -> None:
        options = llvm.create_pipeline_tuning_options()
        passes = llvm.create_new_module_pass_manager()
        passes.add_always_inliner_pass()
        passes.add_instruction_combine_pass()
        passes.add_global_dead_code_eliminate_pass()
        passes.run(self._final_module, llvm.create_pass_builder(self._codegen._tm, options))

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Null: there is no machine code."""
        return 0

    def serialize_using_object_code(self):
        """What the disk keeps: the code for linking alone."""
        return self.serialize_using_bitcode()


def _entry_point(library: Part, described, environment):
    """What stands for the compiled function in Numba's tables; a call of it ends the process."""
    name, module = described.qualname.split(".")[-1], described.lookup_module()
    return make_function(module, name, "for kernels", 0, environment, (library,))


@register_pass(mutates_CFG=True, analysis_only=False)
class _LoweringOfParts(NativeLowering):
    _name = "lowering_of_parts"

    def run_pass(self, state) -> bool:
        state.library = Part(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True  # and so no entry point of Numba's
        super().run_pass(state)
        lowered, library = state["cr"], state.library
        library.finalize()
        entry = _entry_point(library, lowered.fndesc, lowered.env)
        state.targetctx.insert_user_function(entry, lowered.fndesc, [library])
        state.reload_init.extend(library._reload_init)
        state["cr"] = lowered._replace(cfunc=entry)
        return True


class PartCompiler(Compiler):
    """Numba's compiler, which makes a `Part` of a function."""

    def define_pipelines(self):
        """Numba's passes, the one that writes LLVM's code exchanged."""
        pipelines = super().define_pipelines()
        for pipeline in pipelines:
            pipeline.passes = [
                (_LoweringOfParts if each in (NativeLowering, NativeParforLowering) else each, why)
                for each, why in pipeline.passes
            ]
            pipeline._finalized = False
            pipeline.finalize()
        return pipelines


#: How functions chosen by type that LLVM is to inline are compiled.
INLINED_OPTIONS: Any = {**LOOP_OPTIONS, "pipeline_class": PartCompiler}


class DefinedCompiler(Compiler):
    """Compiles a user's function and what it calls so that every operation on numbers has a result.

    Numba lets LLVM take it that sums, differences and products of whole numbers stay within 64 bits
    and that floats made whole do, too: what comes of others changes with what is around them. Here
    the former wrap, and the latter, NaN among them, are the least whole number.
    """

    def compile_extra(self, func):
        with _defined_numbers():
            return super().compile_extra(func)


@contextlib.contextmanager
def _defined_numbers() -> Iterator[None]:
    flags, cast = numbers._int_arith_flags, IRBuilder.fptosi
    numbers._int_arith_flags, IRBuilder.fptosi = _no_flags, _made_whole
    try:
        yield
    finally:
        numbers._int_arith_flags, IRBuilder.fptosi = flags, cast


def _no_flags(kind) -> list[str]:
    return []


_cast_to_whole = IRBuilder.fptosi


def _made_whole(builder, value, kind, name=""):
    found = _cast_to_whole(builder, value, kind, name)
    if (value.type, kind) != (DoubleType(), IntType(64)):
        return found
    limit = 2.0**63
    above = builder.fcmp_ordered(">=", value, value.type(-limit))
    below = builder.fcmp_ordered("<", value, value.type(limit))
    return builder.select(builder.and_(above, below), found, kind(-(2**63)))


def rebuild(target_context, payload) -> CompileResult:
    """A part from what the disk keeps of it, as `CompileResult._rebuild` does for whole code."""
    kept, described, environment, signature, objectmode, lifted, text, initial, referenced = payload
    for each in initial:
        each()
    name, _, bitcode = kept
    library = Part(target_context.codegen(), name)
    library._final_module = llvm.parse_bitcode(bitcode)
    library._finalize_final_module()
    return CompileResult(
        target_context=target_context,
        typing_context=target_context.typing_context,
        library=library,
        environment=environment,
        entry_point=_entry_point(library, described, environment),
        fndesc=described,
        type_annotation=text,
        signature=signature,
        objectmode=objectmode,
        lifted=lifted,
        typing_error=None,
        call_helper=None,
        metadata=None,
        reload_init=initial,
        referenced_envs=referenced,
    )


@contextlib.contextmanager
def rare_collections() -> Iterator[None]:
    """Within the block nobody else compiles, and Python looks for garbage less often.

    Turns to compile that began within it end with it.
    """
    with global_compiler_lock, ending_turns():
        usual = gc.get_threshold()
        gc.set_threshold(_NEW_OBJECTS, *usual[1:])
        try:
            yield
        finally:
            gc.set_threshold(*usual)


class _SealedFile(IndexDataCacheFile):
    """Numba's files of an entry, each with a digest of its place and content behind the content.

    Data states the signature that it was compiled for: of two processes that compile for different
    signatures at once, one may keep the index and the other the data.
    """

    def save(self, key, data):
        super().save(key, (key, data))

    def load(self, key):
        found = super().load(key)
        if found is None or found[0] == key:
            return found and found[1]
        tell(f"compiled code in {self._cache_path} is of another signature: compiling again")
        return None

    def _load_index(self):
        return super()._load_index() if is_sound(self._index_path) else {}

    def _load_data(self, name):
        if not is_sound(path := self._data_path(name)):
            raise OSError(f"{path} is damaged")  # taken as missing
        return super()._load_data(name)

    @contextlib.contextmanager
    def _open_for_write(self, filepath):
        content = io.BytesIO()
        yield content
        with super()._open_for_write(filepath) as file:
            file.write(content.getvalue())
            file.write(seal_file(filepath, content.getbuffer()))


@functools.cache
def _place(folder: str) -> str:
    """Name of a folder of the package by its place there; "" for any other folder."""
    whole = Path(folder).resolve()
    within = whole.is_relative_to(sources.PACKAGE)
    return ".".join(whole.relative_to(sources.PACKAGE.parent).parts) if within else ""


class _Locator(UserProvidedCacheLocator):
    """Our folder alone; it was tried on import, not once more for each of 500 functions.

    The package's own code is found again wherever the package is installed: its place is that in
    the package, and FOLDER is named by the sources' content already. So is a user's file in a
    folder that is named by its content and by that of the files next to it.
    """

    def __init__(self, py_func, py_file):
        super().__init__(py_func, py_file)
        self._stamp = SOURCES if _place(os.path.dirname(py_file)) else None
        if names_the_folder(py_file):
            folder = Path(numba_config().CACHE_DIR)
            self._stamp, self._cache_path = folder.name, str(folder / "files")

    def ensure_cache_path(self):
        os.makedirs(self.get_cache_path(), exist_ok=True)

    @classmethod
    def get_suitable_cache_subpath(cls, py_file):
        return _place(os.path.dirname(py_file)) or super().get_suitable_cache_subpath(py_file)

    def get_source_stamp(self):
        return self._stamp or super().get_source_stamp()


class _Files(CompileResultCacheImpl):
    _locator_classes = (_Locator,)


class _FilesOfWholes(_Files):
    """Of code that Python calls, or that is called by its address, nothing is linked into other
    code: the disk keeps what the processor executes, and the names of what is in it. What linking
    needs is three times as large, and takes longest to read."""

    def reduce(self, data):
        library = data.library
        module, usual = library._final_module, library._shared_module
        parts = (*module.functions, *module.global_variables)
        names = [part.name for part in parts if not part.is_declaration]
        library._shared_module = llvm.parse_assembly("")
        try:
            return names, super().reduce(data._replace(type_annotation=""))
        finally:
            library._shared_module = usual

    def rebuild(self, target_context, payload):
        names, kept = payload
        target_context.codegen()._engine._defined_symbols.update(names)
        return super().rebuild(target_context, kept)


class _FilesOfParts(_Files):
    def rebuild(self, target_context, payload):
        return rebuild(target_context, payload)


class _SealedCache(FunctionCache):
    """Numba's cache of a function, in such files; what it lacks may be among the ready kernels."""

    _impl_class = _FilesOfWholes

    def __init__(self, py_func):
        super().__init__(py_func)
        self._use_files(self._impl.filename_base)

    def _use_files(self, base: str) -> None:
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = _SealedFile(self._cache_path, base, stamp)
        self._ready_file = None
        if READY and stamp == SOURCES:
            place = READY / SOURCES / Path(self._cache_path).name
            self._ready_file = _SealedFile(str(place), base, stamp)

    def of_parts(self) -> "_SealedCache":
        """The cache of the function's form for kernels, in the same folders."""
        made = copy.copy(self)
        made._impl = _FilesOfParts(self._py_func)
        made._use_files(f"{self._impl.filename_base}.for_kernels")
        return made

    def _index_key(self, sig, codegen):
        """Numba's key and, of a user's function, a mark of all that its code is made of."""
        key = super()._index_key(sig, codegen)
        return key if is_own(self._py_func) else (*key, References(self._py_func).mark)

    def _load_overload(self, sig, target_context):
        found = super()._load_overload(sig, target_context)
        if found is None and self._ready_file:
            key = _generic(self._index_key(sig, target_context.codegen()))
            if data := self._ready_file.load(key):
                found = self._impl.rebuild(target_context, data)
        return found

    def load_overload(self, sig, target_context):
        """What is on the disk, without the compiler's tables, which only compiling needs: loading
        them takes a quarter of a second.

        What is not there is this process's to compile, until `end_turns`, or another one's, for
        which it waits.
        """
        rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            found = self._load_overload(sig, target_context)
            if found is None and FOLDER:
                _turns.append(turns.take(FOLDER, f"{self._cache_file._index_path} {sig}"))
                found = self._load_overload(sig, target_context)
            return found

    def save_overload(self, sig, data):
        """Keep compiled code if there is room for it; an index is written by one at a time."""
        try:
            if FOLDER:
                turn = turns.take(FOLDER, self._cache_file._index_path)
                try:
                    super().save_overload(sig, data)
                finally:
                    turns.give_back(FOLDER, turn)
        except OSError as error:
            tell(f"compiled code is not kept, so that it is compiled at every start: {error}")


#: Turns of this process to compile, of the functions that are being compiled.
_turns: list[int | None] = []


@contextlib.contextmanager
def ending_turns() -> Iterator[None]:
    """After the block, end the turns that began within it: the code is kept, or it failed."""
    count = len(_turns)
    try:
        yield
    finally:
        while len(_turns) > count and FOLDER:
            turns.give_back(FOLDER, _turns.pop())


def _generic(key):
    """The key of an entry, for a processor of any kind."""
    signature, (triple, *_), *code = key
    return signature, (triple, *GENERIC.values()), *code


def _closes_over_kernels(plain) -> bool:
    cells = [cell.cell_contents for cell in plain.__closure__ or ()]
    inner = [part for cell in cells for part in (cell if isinstance(cell, tuple) else (cell,))]
    return any(hasattr(part, "_numba_type_") for part in inner)


def keep_compiled(function):
    """A function of Numba, not compiled yet, whose compiled code is kept on the disk.

    That of a notebook's cell, which has no file, is compiled in every process; so is a closure over
    another compiled function, of which the disk would know no more than the name.
    """
    if not (FOLDER or READY) or not hasattr(function, "enable_caching"):
        return function
    plain = function.py_func
    if not os.path.exists(plain.__code__.co_filename) or _closes_over_kernels(plain):
        return function
    try:
        cache = _SealedCache(function.py_func)
    except (RuntimeError, OSError) as error:
        tell(f"compiled code is not kept, so that it is compiled at every start: {error}")
        return function
    if Path(cache.cache_path).is_relative_to(FOLDER or READY):  # the locator may be another
        function._cache = cache
    return function


def keep_off_disk(function) -> None:
    """From now on compile a function of Numba, and its form for kernels, for this process alone."""
    for form in (function, getattr(function, "for_kernels", None)):
        if hasattr(form, "_cache"):
            form._cache = NullCache()


class _InTurns(CPUDispatcher):
    """A compiled function that no two processes compile at once."""

    def compile(self, sig):
        """Compile for a signature, if it is not on the disk."""
        with global_compiler_lock, ending_turns(), naming_symbols(self.py_func):
            return super().compile(sig)


class _Dispatcher(_InTurns):
    """A compiled function with two forms: other kernels call the one that Python cannot call."""

    @functools.cached_property
    def for_kernels(self) -> CPUDispatcher:
        """The form for kernels."""
        options = {**self.targetoptions, **FOR_KERNELS}
        made = _InTurns(self.py_func, targetoptions=options, pipeline_class=PartCompiler)
        if isinstance(self._cache, _SealedCache):
            made._cache = self._cache.of_parts()
        return made

    def compile(self, sig):
        """Compile for a signature, if it is not on the disk; the address for Numba."""
        with rare_collections():
            entry = super().compile(sig)
        whole = self.overloads[tuple(sigutils.normalize_signature(sig)[0])]
        # errors raised in parts of it are made with what belongs to the part
        for each in whole._find_referenced_environments():
            whole.library.codegen.set_env(each.env_name, each)
        return entry

    @property
    def _numba_type_(self):
        return types.Dispatcher(self.for_kernels)


def give_dispatcher(to) -> None:
    """Make the dispatcher of a `Kernel`, unless another thread was first."""
    with global_compiler_lock:
        if to._dispatcher is None:
            to._dispatcher = _make_dispatcher(to.py_func, to.targetoptions, to._is_on_disk)


def _make_dispatcher(function: Callable, options: dict, on_disk: bool) -> CPUDispatcher:
    if options.get("inline") == "always":  # its code becomes part of every caller: one form only
        return CPUDispatcher(function, targetoptions=options)
    made = _Dispatcher(function, targetoptions=options)
    return keep_compiled(made) if on_disk else made


def code_address(dispatcher, signature) -> int:
    """Address of a compiled function for kernels; valid as long as the dispatcher lives."""
    compiled = dispatcher.get_compile_result(signature)
    return compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)


#: `(dispatcher, signature)`: address of a compiled function for C, and for first-class functions.
wrapper_address = _get_wrapper_address

numba_is_loaded()
