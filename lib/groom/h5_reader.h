// Named data of an HDF5 file, its shape and size checked before anything is allocated. Private to the room.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "groom/hdf5_handle.h"

namespace ringlet::groom {

class H5Reader {
 public:
  // Throws Error{kInput} where the file is missing or no HDF5.
  explicit H5Reader(const std::filesystem::path& path);

  bool has(const std::string& name) const;

  // A numeric data set of `columns` columns (0: one-dimensional), any number type, as T (double or int64),
  // row major.
  template <class T>
  std::vector<T> read(const std::string& name, hsize_t columns) const;

  // A one-dimensional data set of strings.
  std::vector<std::string> read_strings(const std::string& name) const;

  // Attributes of the file's root.
  double number_attribute(const std::string& name) const;
  std::string string_attribute(const std::string& name) const;

  // Throws Error{kInput} at a data set or attribute of this file.
  [[noreturn]] void fail(const std::string& name, std::string what, std::string hint = {}) const;

 private:
  Hdf5Handle dataset(const std::string& name) const;
  hsize_t rows(const Hdf5Handle& set, const std::string& name, hsize_t columns) const;
  Hdf5Handle attribute(const std::string& name) const;

  Hdf5Quiet quiet_;
  std::filesystem::path path_;
  std::uintmax_t file_bytes_;
  Hdf5Handle file_;
};

}  // namespace ringlet::groom
