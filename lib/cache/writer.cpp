#include "cache/writer.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <stdexcept>
#include <system_error>
#include <thread>

#include "cache/deflate.h"
#include "cache/layout.h"
#include "cache/resume.h"
#include "core/error.h"
#include "core/log.h"
#include "core/trace.h"

namespace ringlet::cache {
namespace fs = std::filesystem;
namespace {

using Clock = std::chrono::steady_clock;
constexpr Clock::duration kPublishInterval = std::chrono::seconds(1);
constexpr int kPublishShare = 20;  // publishing may take this part of the time

struct Item {
  state::Frame frame;
  state::Snapshot snapshot;
  double seconds = 0;
};

std::size_t bytes_of(const state::Frame& frame) {
  std::size_t floats = frame.position.size() + frame.velocity.size() + frame.elongation.size() +
                       frame.living.size() + frame.guide_position.size();
  for (const auto& vertices : frame.surface_vertices) floats += vertices.size();
  return floats * sizeof(float) + 65536;
}

std::size_t bytes_of(const state::RunHeader& header) {
  return header.rest_position.size() * 6 + header.offsets.size() * 32 +
         header.interpolation.guide.size() * 8 + header.interpolation.guides.size() * 16 +
         header.scene_json.size() + 65536;
}

}  // namespace

struct CacheWriter::Impl {
  Files files;
  state::RunHeader header;
  Storage storage;
  std::size_t capacity;
  std::optional<state::Snapshot> resume_point;

  // Shared with the writing thread.
  std::mutex mutex;
  std::condition_variable item_or_stop, room;
  std::deque<Item> queue;
  bool stopping = false;
  std::exception_ptr error;

  bool error_told = false;  // to the caller

  // The writing thread's own, and after it has ended, of `finish`.
  std::map<int, FrameRecord> records;
  std::optional<state::Snapshot> unpublished_state;
  bool master_stale = false;
  Clock::time_point publish_due{};

  std::thread thread;

  Impl(const fs::path& directory, state::RunHeader run_header, const WriterOptions& options)
      : files{directory, run_header.name},
        header(std::move(run_header)),
        storage{options.compression, options.error},
        capacity(std::max<std::size_t>(options.queue, 1)) {
    if (storage.compression == Compression::kQuantised &&
        !(storage.error > 0 && std::isfinite(storage.error)))
      throw Error(ErrorKind::kUsage, "",
                  fmt::format("an error of {} cannot bound quantised positions", storage.error));
    check_destination(directory, header.name, options.existing);
    make_directory(directory);
    prepare(options.existing);
    write_master();
    thread = std::thread([this] { run(); });
  }

  void prepare(Existing existing) {
    if (existing == Existing::kOverwrite) return files.remove_all();
    if (existing == Existing::kResume) {
      Remains remains = find_remains(files, header);
      records = std::move(remains.frames);
      resume_point = std::move(remains.snapshot);
    }
    files.remove_leftovers();
  }

  // ---- The writing thread -----------------------------------------------------------------------

  void run() {
    trace::name_thread("writing");
    try {
      for (std::optional<Item> item; next(item);) {
        if (item) store(std::move(*item));
        if (stale() && Clock::now() >= publish_due) publish();
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      error = std::current_exception();
      queue.clear();
      room.notify_all();
    }
  }

  bool stale() const { return master_stale || unpublished_state; }

  // Waits for a frame, or until publishing is due (no item then). False: there will be no more.
  bool next(std::optional<Item>& item) {
    item.reset();
    std::unique_lock lock(mutex);
    const auto ready = [this] { return stopping || !queue.empty(); };
    if (!stale()) {
      item_or_stop.wait(lock, ready);
    } else if (!item_or_stop.wait_until(lock, publish_due, ready)) {
      return true;
    }
    if (queue.empty()) return false;
    item = std::move(queue.front());
    queue.pop_front();
    room.notify_one();
    return true;
  }

  void store(Item item) {
    trace::Span span("write", "cache");
    span.tell("frame", item.frame.number);
    const fs::path path = files.frame(item.frame.number);
    {
      const h5::Image image(path, bytes_of(item.frame));
      write_identity(image, Content::kFrame);
      write_frame(image, item.frame, storage);
      write_atomically(path, image.bytes());
    }
    records[item.frame.number] = record_of(item.frame);
    master_stale = true;
    if (!item.snapshot.arrays.empty()) unpublished_state = std::move(item.snapshot);
    append_line(files.timings(),
                fmt::format(R"({{"frame": {}, "seconds": {:.6f}}})", item.frame.number, item.seconds));
  }

  void publish() {
    const trace::Span span("publish", "cache");
    const Clock::time_point start = Clock::now();
    if (unpublished_state) write_state();
    if (master_stale) write_master();
    const Clock::time_point end = Clock::now();
    publish_due = end + std::max(kPublishInterval, kPublishShare * (end - start));
  }

  void write_state() {
    std::size_t bytes = 65536;
    for (const auto& [name, array] : unpublished_state->arrays) bytes += array.size();
    const h5::Image image(files.state(), bytes);
    write_identity(image, Content::kState);
    image.set("name", header.name);
    write_snapshot(image, *unpublished_state, hash_of(header));
    write_atomically(files.state(), image.bytes());
    unpublished_state.reset();
  }

  void write_master() {
    const h5::Image image(files.master(), bytes_of(header));
    write_identity(image, Content::kMaster);
    write_header(image, header);
    write_storage(image, storage);
    write_sequence(image, records, header, files);
    write_atomically(files.master(), image.bytes());
    master_stale = false;
  }

  // ---- The caller's side ------------------------------------------------------------------------

  void push(Item item) {
    std::unique_lock lock(mutex);
    room.wait(lock, [this] { return error || queue.size() < capacity; });
    if (error) tell();
    queue.push_back(std::move(item));
    item_or_stop.notify_one();
  }

  void stop() {
    {
      const std::lock_guard lock(mutex);
      stopping = true;
      item_or_stop.notify_one();
    }
    if (thread.joinable()) thread.join();
  }

  void finish() {
    stop();
    try {
      publish();
    } catch (const Error&) {
      if (!error) error = std::current_exception();  // otherwise the first error tells more
    }
    if (error) tell();
  }

  [[noreturn]] void tell() {
    error_told = true;
    std::rethrow_exception(error);
  }
};

CacheWriter::CacheWriter(const fs::path& directory, state::RunHeader header, const WriterOptions& options)
    : impl_(std::make_unique<Impl>(directory, std::move(header), options)) {}

CacheWriter::~CacheWriter() {
  const bool told = impl_->error_told;
  try {
    impl_->finish();
  } catch (const std::exception& failure) {
    if (!told) log_warning(failure.what());
  }
}

std::optional<state::Snapshot> CacheWriter::take_resume_point() {
  return std::exchange(impl_->resume_point, {});
}

void CacheWriter::write(state::Frame frame, state::Snapshot snapshot, double seconds) {
  if (frame.position.size() != impl_->header.rest_position.size())
    throw std::invalid_argument("a frame of another number of particles than its cache");
  impl_->push({std::move(frame), std::move(snapshot), seconds});
}

void CacheWriter::finish() { impl_->finish(); }

// ---- Free functions -----------------------------------------------------------------------------

void check_destination(const fs::path& directory, const std::string& name, Existing existing) {
  const Files files{directory, name};
  if (existing == Existing::kRefuse && files.exist()) {
    throw Error(ErrorKind::kUsage, files.master().string(), "a cache is already there",
                "--resume goes on with it, --overwrite starts anew, -o writes elsewhere");
  }
  fs::path ancestor = fs::absolute(directory);
  std::error_code error;
  while (!fs::exists(ancestor, error) && ancestor.has_relative_path()) ancestor = ancestor.parent_path();
  if (!fs::is_directory(ancestor, error)) {
    throw Error(ErrorKind::kIo, directory.string(),
                "the directory cannot be made: " + ancestor.string() + " is not a directory");
  }
  if (::access(ancestor.c_str(), W_OK | X_OK) != 0) {
    throw Error(ErrorKind::kIo, directory.string(),
                "cannot be written: " + std::generic_category().message(errno),
                "choose another directory with -o");
  }
}

void write_failed_state(const fs::path& path, const state::RunHeader& header, const state::Frame& frame,
                        const Failure& failure) {
  const h5::Image image(path, bytes_of(header) + bytes_of(frame));
  write_identity(image, Content::kFailed);
  write_failure(image, failure);
  write_header(image, header);
  write_storage(image, {});
  write_single(image, frame);
  write_atomically(path, image.bytes());
}

}  // namespace ringlet::cache
