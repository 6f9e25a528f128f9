// SPDX-License-Identifier: Apache-2.0
// Whether the inputs of a model built with BOTH_EDGES (RtlModel.cmake) may have changed since its latest evaluation;
// if not, what depends on them need not be evaluated again before the edge (VerilatedUnity.cmake). By thread.
extern __thread bool psweep_inputs_changed;
__thread bool psweep_inputs_changed = true;
