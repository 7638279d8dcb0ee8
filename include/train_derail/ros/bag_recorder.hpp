/// \file
/// Recording of a run into a bag. The sender itself writes it, so it is complete from the first message on.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>

#include <rosbag/bag.h>

#include "train_derail/files/output_file.hpp"
#include "train_derail/ros/message_sink.hpp"

namespace train_derail::ros_face {

/// Writes every topic but /clock, which `rosbag play --clock` makes. A message is recorded as received at its own
/// stamp, and its topic is latched as the node latches it. A full disk ends the recording, not the run.
class BagRecorder : public MessageSink {
 public:
  /// Records something that happens only once. Writes `path`.active, which is locked, and renames it to `path` when it
  /// is closed. Neither of the two is overwritten if it exists. After a kill `rosbag reindex` repairs the .active file.
  /// `node` is the full name of the node whose topics these are, such as "/train_derail". Throws files::ExistsError if
  /// one of the two files exists, and std::runtime_error, which names the file, if it cannot be opened or if another
  /// process is recording it.
  BagRecorder(std::string path, std::string node);
  /// Records something that can be computed again: the file is whole or not there, and a kill leaves nothing. Throws
  /// std::runtime_error if `file` is not a regular file or cannot be written.
  BagRecorder(files::OutputFile file, std::string node);
  ~BagRecorder() override { close(); }
  /// Completes the bag. Afterwards error() says whether that has worked.
  void close();
  /// Gives up a recording into an OutputFile; no file is left. Must not be called after close().
  void discard();
  /// Returns the first error with the name of the file, or "" if there was none. After an error nothing more is
  /// written.
  const std::string& error() const { return error_; }
  /// Returns the name that the bag has when it is complete.
  const std::string& path() const { return path_; }

  bool wants_markers() const override { return true; }
  bool is_read_from_the_middle() const override { return true; }

 private:
  void begin(const std::string& name);
  void fail(const std::string& what);
  void receive(const AnyMessage& message) override;
  void unlock();

  const std::string path_, node_;
  std::optional<files::OutputFile> file_;
  int lock_ = -1;                     ///< descriptor of the locked `path`.active; -1 with an OutputFile
  std::unique_ptr<rosbag::Bag> bag_;  ///< null once closed
  std::string error_;
  ::ros::Time now_;  ///< newest stamp so far
  /// Header of each topic in the bag, in the order of Topics. It is made with the first message of the topic.
  std::array<boost::shared_ptr<::ros::M_string>, kTopicCount> connections_;
};

/// Returns the absolute name of the bag to be written. If `bag` is a folder, this is a new file in it that is named by
/// date and time of day.
std::string bag_path(const std::string& bag);

}  // namespace train_derail::ros_face
