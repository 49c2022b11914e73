"""What is used of Numba beyond its documentation exists, and stands behind one file."""

import ast
import importlib
import inspect
from pathlib import Path

import pytest
from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    UserProvidedCacheLocator,
)
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, CompilerBase, CompileResult
from numba.core.compiler_machinery import PassManager
from numba.core.cpu import CPUContext
from numba.core.extending import _Intrinsic
from numba.core.registry import CPUDispatcher, cpu_target

from torquer.compile import engine
from torquer.compile.sources import PACKAGE

HOME = PACKAGE / "compile" / "numba_private.py"
#: Modules that Numba documents, and names in `numba` itself.
DOCUMENTED = {
    "numba": {"types", "njit", "typeof", "from_dtype", "config", "__version__", "extending"},
    "numba.extending": {
        "NativeValue", "intrinsic", "lower_builtin", "models", "overload", "register_model",
        "typeof_impl", "unbox",
    },
}  # fmt: skip
#: Names that are imported, by module.
NAMES = {
    "numba._dynfunc": ["make_function"],
    "numba.core": ["cgutils", "event", "sigutils"],
    "numba.core.caching": [
        "CompileResultCacheImpl", "FunctionCache", "IndexDataCacheFile", "NullCache",
        "UserProvidedCacheLocator",
    ],
    "numba.core.codegen": ["JITCodeLibrary"],
    "numba.core.compiler": ["Compiler", "CompileResult"],
    "numba.core.compiler_lock": ["global_compiler_lock"],
    "numba.core.compiler_machinery": ["register_pass"],
    "numba.core.errors": ["NumbaError", "UnsupportedBytecodeError"],
    "numba.core.imputils": ["lower_getattr_generic", "lower_setattr_generic"],
    "numba.core.registry": ["CPUDispatcher"],
    "numba.core.runtime": ["rtsys"],
    "numba.core.typed_passes": ["NativeLowering", "NativeParforLowering"],
    "numba.core.typeinfer": ["register_dispatcher"],
    "numba.core.utils": ["_dynamic_modname", "_dynamic_module"],
    "numba.cpython": ["numbers"],
    "numba.core.typing.templates": [
        "AbstractTemplate", "AttributeTemplate", "infer_getattr", "infer_global", "signature",
    ],
    "numba.experimental.function_type": ["_get_wrapper_address"],
}  # fmt: skip
#: Attributes of classes.
OF_CLASSES = {
    CPUDispatcher: [
        "_numba_type_", "compile", "disable_compile", "enable_caching", "get_compile_result",
        "nopython_signatures", "signatures", "stats",
    ],
    JITCodeLibrary: [
        "_finalize_dynamic_globals", "_finalize_final_module", "_optimize_final_module",
        "_verify_declare_only_symbols", "codegen", "finalize", "get_pointer_to_function",
        "serialize_using_bitcode", "serialize_using_object_code",
    ],
    CompileResult: [
        "_find_referenced_environments", "_rebuild", "_reduce", "_replace", "call_helper",
        "entry_point", "environment", "fndesc", "library", "lifted", "metadata", "objectmode",
        "referenced_envs", "reload_init", "signature", "target_context", "type_annotation",
        "typing_context", "typing_error",
    ],
    Compiler: ["define_pipelines"],
    PassManager: ["finalize"],
    FunctionCache: [
        "_guard_against_spurious_io_errors", "_impl_class", "_index_key", "_load_overload",
        "cache_path", "load_overload", "save_overload",
    ],
    CompileResultCacheImpl: [
        "_locator_classes", "filename_base", "locator", "rebuild", "reduce",
    ],
    IndexDataCacheFile: [
        "_data_path", "_load_data", "_load_index", "_open_for_write", "load", "save",
    ],
    UserProvidedCacheLocator: [
        "ensure_cache_path", "get_cache_path", "get_source_stamp", "get_suitable_cache_subpath",
    ],
    CPUContext: [
        "call_conv", "cast", "codegen", "get_abi_sizeof", "get_constant", "get_data_type",
        "get_dummy_value", "get_value_type", "insert_user_function", "make_array", "make_tuple",
    ],
}  # fmt: skip
#: Attributes that an instance gets from the code of its class, or of one above it.
OF_INSTANCES = {
    CPUDispatcher: ["_cache", "overloads", "py_func", "targetctx", "targetoptions"],
    JITCodeLibrary: ["_codegen", "_final_module", "_finalized", "_reload_init", "_shared_module"],
    PassManager: ["_finalized", "passes"],
    FunctionCache: ["_cache_file", "_cache_path", "_impl", "_py_func"],
    IndexDataCacheFile: ["_cache_path", "_index_path"],
    UserProvidedCacheLocator: ["_cache_path", "_py_file"],
    _Intrinsic: ["_defn"],
    CompilerBase: ["flags", "func_id", "library", "reload_init", "targetctx"],
}


@pytest.mark.parametrize("module", NAMES)
def test_what_is_imported_is_there(module):
    home = importlib.import_module(module)
    for name in NAMES[module]:
        assert hasattr(home, name) or importlib.import_module(f"{module}.{name}"), name


@pytest.mark.parametrize("owner", OF_CLASSES)
def test_classes_have_the_attributes(owner):
    assert [name for name in OF_CLASSES[owner] if not hasattr(owner, name)] == []


@pytest.mark.parametrize("owner", OF_INSTANCES)
def test_instances_get_the_attributes(owner):
    code = "".join(inspect.getsource(each) for each in owner.__mro__ if each.__module__[0] == "n")
    written = [f"self.{name} =" for name in OF_INSTANCES[owner]]
    stated = [f"self.state.{name} =" for name in OF_INSTANCES[owner]]
    known = {name for pair in zip(written, stated, strict=True) for name in pair if name in code}
    assert len(known) == len(OF_INSTANCES[owner]), set(written) - known


def test_codegen_knows_its_machine_and_environments():
    codegen = cpu_target.target_context.codegen()
    assert codegen._tm and codegen.set_env and codegen.magic_tuple()
    assert isinstance(codegen._engine._defined_symbols, set)


def imported(tree: ast.AST) -> set[tuple[str, str]]:
    """Modules and names that a file imports of Numba."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {(alias.name, "") for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found |= {(node.module or "", alias.name) for alias in node.names}
    return {pair for pair in found if pair[0].split(".")[0] == "numba"}


def attributes(tree: ast.AST) -> set[str]:
    """Names of attributes that a file reads or writes."""
    return {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)}


#: What nothing else in the package has as an attribute, either.
PRIVATE = {
    name
    for table in (OF_CLASSES, OF_INSTANCES)
    for names in table.values()
    for name in names
    if name.startswith("_") and name not in ("_numba_type_", "_replace")
} | {"fndesc", "get_compile_result", "overloads", "set_env", "targetctx", "typingctx"}


def test_the_home_imports_what_is_named_here():
    pairs = {(module, name) for module, names in NAMES.items() for name in names}
    used = imported(ast.parse(HOME.read_text(encoding="utf-8")))
    assert {pair for pair in used if pair[0] not in DOCUMENTED} == pairs


@pytest.mark.parametrize("room", sorted(p.name for p in PACKAGE.iterdir() if p.is_dir()))
def test_no_other_file_reaches_into_numba(room):
    for file in (PACKAGE / room).rglob("*.py"):
        if file == HOME:
            continue
        tree = ast.parse(file.read_text(encoding="utf-8"))
        for module, name in imported(tree):
            assert module in DOCUMENTED, f"{file}: {module}"
            assert not name or name in DOCUMENTED[module], f"{file}: {module}.{name}"
        assert not attributes(tree) & PRIVATE, f"{file}: {attributes(tree) & PRIVATE}"


def test_the_scan_sees_what_it_must_not_find():
    text = "from numba.core import x\nimport numba.core.y\nkernel._cache = kernel.overloads\n"
    tree = ast.parse(text)
    assert imported(tree) == {("numba.core", "x"), ("numba.core.y", "")}
    assert attributes(tree) == {"_cache", "overloads"}
    assert Path(engine.__file__) != HOME


def test_whole_numbers_wrap_in_numba_by_flags_that_are_replaced():
    from llvmlite.ir import IRBuilder
    from numba.cpython import numbers

    assert callable(numbers._int_arith_flags)
    assert "_int_arith_flags(sig.return_type)" in inspect.getsource(numbers.int_mul_impl)
    assert "builder.fptosi" in inspect.getsource(numbers.float_to_integer)
    assert callable(IRBuilder.fptosi)
