// Faults of rigs, found from silhouettes.
#include <pybind11/stl.h>

#include "module.h"
#include "tactus/base/error.h"
#include "tactus/reconstruct/doctor/rig_doctor.h"

namespace tactus::python {
namespace {

/// A diagnosis, and the rig with all cures.
struct PyDiagnosis {
  Diagnosis found;
  Rig cured;
};

}  // namespace
}  // namespace tactus::python

TACTUS_BOUND(tactus::python::PyDiagnosis);
TACTUS_BOUND(tactus::DoctorFinding);

namespace tactus::python {
namespace {

PyDiagnosis examine(const Rig& rig, const std::vector<std::shared_ptr<FrameSet>>& frames) {
  if (frames.empty())
    throw usage_error("frames is empty, expected one Frame, or several of successive ticks");
  DoctorInput input{.cameras = rig.cameras, .ticks = {}, .workspace_m = rig.workspace_m};
  for (const auto& frame : frames) {
    if (frame->silhouettes.size() != rig.cameras.size())
      throw usage_error("frames[" + std::to_string(input.ticks.size()) + "] has " +
                        std::to_string(frame->silhouettes.size()) + " masks, expected one for each of the " +
                        std::to_string(rig.cameras.size()) + " cameras");
    input.ticks.push_back(frame->silhouettes);
  }
  PyDiagnosis diagnosis{examine_rig(input), rig};
  diagnosis.cured.cameras = diagnosis.found.cameras;
  diagnosis.cured.workspace_m = diagnosis.found.workspace_m;
  return diagnosis;
}

}  // namespace

void bind_doctor(py::module_& m) {
  py::class_<DoctorFinding>(m, "DoctorFinding", "A fault of a rig, and its cure.")
      .def_readonly("camera", &DoctorFinding::camera, "index; -1: all")
      .def_readonly("other", &DoctorFinding::other, "the second of two that are swapped; else -1")
      .def_readonly("fault", &DoctorFinding::fault)
      .def_readonly("cure", &DoctorFinding::cure)
      .def_readonly("recall_before", &DoctorFinding::recall_before, "mean over the views")
      .def_readonly("recall_after", &DoctorFinding::recall_after)
      .def_readonly("is_fault", &DoctorFinding::is_fault, "False: worth a word, nothing wrong")
      .def("__repr__",
           [](const DoctorFinding& f) { return "tactus.DoctorFinding(" + f.fault + ": " + f.cure + ")"; });
  py::class_<PyDiagnosis>(m, "Diagnosis", "What doctor() found.")
      .def_property_readonly(
          "verdict", [](const PyDiagnosis& d) { return verdict_name(d.found.verdict); },
          "'well', 'faulty' or 'unsure'")
      .def_property_readonly(
          "why", [](const PyDiagnosis& d) { return d.found.why; }, "the verdict in a sentence")
      .def_property_readonly(
          "help", [](const PyDiagnosis& d) { return d.found.help; }, "of 'unsure': evidence that would help")
      .def_property_readonly("findings", [](const PyDiagnosis& d) { return d.found.findings; })
      .def_property_readonly(
          "recall_before", [](const PyDiagnosis& d) { return d.found.recall_before; }, "per camera")
      .def_property_readonly(
          "recall_after", [](const PyDiagnosis& d) { return d.found.recall_after; }, "per camera")
      .def_property_readonly(
          "rig", [](const PyDiagnosis& d) { return d.cured; }, "with all cures")
      .def("__repr__", [](const PyDiagnosis& d) {
        return std::string("tactus.Diagnosis(") + verdict_name(d.found.verdict) + ": " + d.found.why + ")";
      });
  m.def("doctor", &examine, py::arg("rig"), py::arg("frames"), py::call_guard<py::gil_scoped_release>(),
        "Finds the wrong cameras of a rig, their faults and the cures, by silhouettes alone: a Diagnosis.\n\n"
        "frames: Frames of successive ticks. The first is examined; the others tell late cameras. Takes "
        "seconds.\n"
        "Raises Error without masks, or when sizes contradict one another.");
  m.attr("examine_rig") = m.attr("doctor");  // its name in C++
}

}  // namespace tactus::python
