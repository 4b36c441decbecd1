// The symbolic kinematics of one serial finger: Pinocchio's model and algorithms with casadi::SX as the scalar.

#include <pinocchio/autodiff/casadi.hpp>

#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/kinematics.hpp>

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include <string>
#include <vector>

namespace
{

using casadi::SX;

// Pinocchio's own collection has 25 joint types, every one of them compile time and memory; a finger needs one.
// Composite and mimic joints are never used, but the algorithms name them, so they have to be in the variant.
template<typename S, int O>
struct FingerJoints
{
  using Scalar = S;
  static constexpr int Options = O;

  using JointModelRevoluteUnaligned = pinocchio::JointModelRevoluteUnalignedTpl<S, O>;
  using JointModelComposite = pinocchio::JointModelCompositeTpl<S, O, ::FingerJoints>;
  using JointModelMimic = pinocchio::JointModelMimicTpl<S, O, ::FingerJoints>;
  using JointModelVariant = boost::variant<
    JointModelRevoluteUnaligned,
    boost::recursive_wrapper<JointModelComposite>,
    boost::recursive_wrapper<JointModelMimic>>;

  using JointDataRevoluteUnaligned = pinocchio::JointDataRevoluteUnalignedTpl<S, O>;
  using JointDataComposite = pinocchio::JointDataCompositeTpl<S, O, ::FingerJoints>;
  using JointDataMimic = pinocchio::JointDataMimicTpl<S, O, ::FingerJoints>;
  using JointDataVariant = boost::variant<
    JointDataRevoluteUnaligned,
    boost::recursive_wrapper<JointDataComposite>,
    boost::recursive_wrapper<JointDataMimic>>;
};

using Model = pinocchio::ModelTpl<SX, 0, FingerJoints>;
using Data = Model::Data;
using Joint = Model::JointModel;
using Axis = FingerJoints<SX, 0>::JointModelRevoluteUnaligned;
using Frame = Model::Frame;
using SE3 = Model::SE3;
using Vector3 = SE3::Vector3;
using Matrix3 = SE3::Matrix3;

template<typename Derived>
SX to_casadi(const Eigen::MatrixBase<Derived> & values)
{
  SX result;
  pinocchio::casadi::copy(values, result);
  return SX::densify(result);
}

Vector3 column(const SX & matrix, int j)
{
  return Vector3(matrix(0, j), matrix(1, j), matrix(2, j));
}

SE3 translation(const Vector3 & offset)
{
  return SE3(Matrix3::Identity(), offset);
}

Matrix3 rotation(const SX & matrices, int j)
{
  Matrix3 result;
  for (int k = 0; k < 3; ++k)
    result.col(k) = column(matrices, 3 * j + k);
  return result;
}

Vector3 along_z(const SX & length)
{
  return Vector3(SX(0), SX(0), length);
}

// The finger's morphology as symbols.
struct Finger
{
  explicit Finger(int joints)
  : base(SX::sym("base", 3))
  , turns(SX::sym("turns", 3, 3 * joints))
  , axes(SX::sym("axes", 3, joints))
  , lengths(SX::sym("lengths", joints))
  , point(SX::sym("point", 3))
  {
    pinocchio::JointIndex last = 0;
    for (int j = 0; j < joints; ++j)
    {
      const Vector3 origin = j == 0 ? column(base, 0) : along_z(lengths(j - 1));
      // The vector constructor takes the axis as it is; the one of three scalars would divide by its norm.
      last = model.addJoint(
        last, Joint(Axis(column(axes, j))), SE3(rotation(turns, j), origin), "joint" + std::to_string(j));
    }
    tip = add_frame("tip", last, along_z(lengths(joints - 1)));
    contact = add_frame("contact", last, column(point, 0));
  }

  pinocchio::FrameIndex add_frame(const std::string & name, pinocchio::JointIndex joint, const Vector3 & offset)
  {
    return model.addFrame(Frame(name, joint, 0, translation(offset), pinocchio::OP_FRAME), false);
  }

  SX base;
  SX turns;
  SX axes;
  SX lengths;
  SX point;
  Model model;
  pinocchio::FrameIndex tip = 0;
  pinocchio::FrameIndex contact = 0;
};

std::string finger_kinematics(int joints)
{
  const Finger finger(joints);
  const SX angles = SX::sym("angles", joints);

  Model::ConfigVectorType configuration(joints);
  pinocchio::casadi::copy(angles, configuration);

  Data data(finger.model);
  pinocchio::computeJointJacobians(finger.model, data, configuration);
  pinocchio::updateFramePlacements(finger.model, data);
  Data::Matrix6x jacobian = Data::Matrix6x::Zero(6, joints);
  pinocchio::getFrameJacobian(finger.model, data, finger.contact, pinocchio::LOCAL_WORLD_ALIGNED, jacobian);

  std::vector<SX> origins;
  std::vector<SX> rotations;
  for (int j = 1; j <= joints; ++j) // joint 0 is Pinocchio's universe
  {
    origins.push_back(to_casadi(data.oMi[j].translation()));
    rotations.push_back(to_casadi(data.oMi[j].rotation()));
  }
  const casadi::Function function(
    "finger_kinematics_" + std::to_string(joints),
    {finger.base, finger.turns, finger.axes, finger.lengths, angles, finger.point},
    {SX::horzcat(origins), SX::horzcat(rotations), to_casadi(data.oMf[finger.tip].translation()),
     to_casadi(data.oMf[finger.contact].translation()), to_casadi(jacobian.topRows<3>())},
    {"base", "turns", "axes", "lengths", "angles", "point"}, {"origins", "rotations", "tip", "contact", "jacobian"});
  return function.serialize();
}

} // namespace

NB_MODULE(_extension, module)
{
  module.def(
    "finger_kinematics", &finger_kinematics, nanobind::arg("joints"),
    "The serialised casadi::Function of a finger with this many joints.");
}
