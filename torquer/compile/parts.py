"""Kernels that only kernels call: compiled to be part of what calls them, not to be run.

Numba optimises every function and makes machine code of it, and does both again where the function
is part of a caller, and of that one's caller. Here only what Python calls, or what is called by its
address, goes through that. What it calls is linked into it as it was lowered, but for the functions
that are always inlined.
"""

import llvmlite.binding as llvm
from numba._dynfunc import make_function
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, CompileResult
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering, NativeParforLowering


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


def rebuilt(target_context, payload) -> CompileResult:
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
