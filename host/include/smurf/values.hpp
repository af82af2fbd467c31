// Vectors of results. Memory is not cleared before a device writes to it, and blocks of many pages are kept for the
// next results when they are given back (64 MiB at most, and of large ones 512 MiB more, which stand on large pages and
// which the system may reclaim): clearing and page faults would cost as much as a fast query itself.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace smurf {

void* allocate_results(std::size_t bytes);  // throws std::bad_alloc
void free_results(void* memory) noexcept;

template <class T>
struct ResultAllocator {
  static_assert(std::is_trivially_copyable_v<T>);
  using value_type = T;
  ResultAllocator() = default;
  template <class U>
  ResultAllocator(const ResultAllocator<U>&) {}
  T* allocate(std::size_t count) { return static_cast<T*>(allocate_results(count * sizeof(T))); }
  void deallocate(T* memory, std::size_t) noexcept { free_results(memory); }
  // Elements without an initial value stay as they are, also where their type has values of its own to begin with: a
  // device writes them.
  template <class U>
  void construct(U*) noexcept {
    static_assert(std::is_trivially_copyable_v<U>);
  }
  template <class U, class... Arguments>
  void construct(U* at, Arguments&&... arguments) {
    ::new (static_cast<void*>(at)) U(std::forward<Arguments>(arguments)...);
  }
  template <class U>
  bool operator==(const ResultAllocator<U>&) const {
    return true;
  }
};

template <class T>
using Values = std::vector<T, ResultAllocator<T>>;

// A column of results: read-only values in memory that columns and their copies share, so that a device can write many
// columns at once and none is copied.
template <class T>
class Column {
 public:
  using value_type = T;
  Column() = default;
  Column(std::shared_ptr<const void> owner, std::span<const T> values) : owner_(std::move(owner)), values_(values) {}
  Column(Values<T> values) {
    const auto kept = std::make_shared<const Values<T>>(std::move(values));
    values_ = *kept;
    owner_ = kept;
  }

  std::size_t size() const { return values_.size(); }
  bool empty() const { return values_.empty(); }
  const T& operator[](std::size_t index) const { return values_[index]; }
  const T* data() const { return values_.data(); }
  auto begin() const { return values_.begin(); }
  auto end() const { return values_.end(); }
  operator std::span<const T>() const { return values_; }
  friend bool operator==(const Column& a, const Column& b) { return std::ranges::equal(a.values_, b.values_); }

 private:
  std::shared_ptr<const void> owner_;
  std::span<const T> values_;
};

}  // namespace smurf
