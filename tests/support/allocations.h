#pragma once
/// Counts what a program takes with `new`: link support/allocations.cpp into it.

namespace tactus::test {

/// From construction on.
class AllocationCount {
 public:
  AllocationCount();
  long long so_far() const;

 private:
  long long before_;
};

}  // namespace tactus::test
