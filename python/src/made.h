#pragma once
/// Arguments that are objects of this module are checked to have been initialised. pybind11 would hand over
/// memory that nobody wrote: `World.__new__(World)`, or a class that uses itself before `super().__init__()`.
#include <pybind11/pybind11.h>

#include <memory>
#include <string>

namespace tactus::python {

/// @throws TypeError for an object of T whose __init__ has not run to its end.
template <class T>
void expect_made(pybind11::handle value) {
  namespace detail = pybind11::detail;
  const detail::type_info* const type = detail::get_type_info(typeid(T));
  if (!value || type == nullptr || PyObject_TypeCheck(value.ptr(), type->type) == 0) return;
  auto* const instance = reinterpret_cast<detail::instance*>(value.ptr());
  if (instance->get_value_and_holder(type).value_ptr() != nullptr) return;
  const std::string name = Py_TYPE(value.ptr())->tp_name;
  throw pybind11::type_error("this " + name + " was not initialised: expected an object made by " + name +
                             "(..), and super().__init__(..) before anything else in a class of your own");
}

template <class T>
class MadeCaster : public pybind11::detail::type_caster_base<T> {
 public:
  bool load(pybind11::handle value, bool convert) {
    expect_made<T>(value);
    return pybind11::detail::type_caster_base<T>::load(value, convert);
  }
};

template <class T>
class MadeHolderCaster : public pybind11::detail::copyable_holder_caster<T, std::shared_ptr<T>> {
 public:
  bool load(pybind11::handle value, bool convert) {
    expect_made<T>(value);
    return pybind11::detail::copyable_holder_caster<T, std::shared_ptr<T>>::load(value, convert);
  }
};

}  // namespace tactus::python

/// For every class of the module, outside of namespaces and before its first use.
#define TACTUS_BOUND(T)                                                             \
  template <>                                                                       \
  class pybind11::detail::type_caster<T> : public tactus::python::MadeCaster<T> {}; \
  template <>                                                                       \
  class pybind11::detail::type_caster<std::shared_ptr<T>> : public tactus::python::MadeHolderCaster<T> {}
