#pragma once

#include "curlew/field/Batch.h"

#include <concepts>
#include <limits>
#include <memory>

namespace curlew {

namespace detail {

/// What a field is made of: one virtual call per batch, for each precision and order of derivatives.
class FieldModel {
  public:
    virtual ~FieldModel() = default;
    virtual void eval(const PointBatch&, JetBatch<float, 0>&) const = 0;
    virtual void eval(const PointBatch&, JetBatch<float, 1>&) const = 0;
    virtual void eval(const PointBatch&, JetBatch<float, 2>&) const = 0;
    virtual void eval(const PointBatch&, JetBatch<double, 0>&) const = 0;
    virtual void eval(const PointBatch&, JetBatch<double, 1>&) const = 0;
    virtual void eval(const PointBatch&, JetBatch<double, 2>&) const = 0;
    virtual double bound() const = 0;
};

} // namespace detail

/// A model whose jets are computed position by position: `model.at<Order, T>(position)`.
template <class M>
concept PointwiseModel = requires(const M& m, const Vec3d& p) {
    { m.template at<2, double>(p) } -> std::same_as<Jet<double, 3, 2>>;
};

/// A scalar function of position with exact derivatives up to the second: a cheap handle on an immutable model. Copies
/// share the model; evaluation is safe from any number of threads.
///
/// T is the precision of values and derivatives (float or double). Positions are always double.
class ScalarField {
  public:
    /// A field from a model M, which is either pointwise (above) or has
    /// `template <int Order, class T> void evalBatch(const PointBatch&, JetBatch<T, Order>&) const`;
    /// and may have `double bound() const`.
    template <class M>
    requires(!std::same_as<std::remove_cvref_t<M>, ScalarField>) explicit ScalarField(M model)
        : mModel(std::make_shared<const Model<M>>(std::move(model))) {}

    template <class T, int Order>
    void eval(const PointBatch& points, JetBatch<T, Order>& jets) const {
        mModel->eval(points, jets);
    }

    /// The jet at one position. For many, batches are faster.
    template <int Order, class T = double>
    Jet<T, 3, Order> at(const Vec3d& position) const {
        PointBatch points;
        points.push(position);
        JetBatch<T, Order> jets;
        eval(points, jets);
        return jets[0];
    }

    /// A number that |value| never exceeds; infinite where none is known.
    double bound() const { return mModel->bound(); }

  private:
    template <class M>
    class Model final : public detail::FieldModel {
      public:
        explicit Model(M model) : mM(std::move(model)) {}
        void eval(const PointBatch& p, JetBatch<float, 0>& j) const override { run(p, j); }
        void eval(const PointBatch& p, JetBatch<float, 1>& j) const override { run(p, j); }
        void eval(const PointBatch& p, JetBatch<float, 2>& j) const override { run(p, j); }
        void eval(const PointBatch& p, JetBatch<double, 0>& j) const override { run(p, j); }
        void eval(const PointBatch& p, JetBatch<double, 1>& j) const override { run(p, j); }
        void eval(const PointBatch& p, JetBatch<double, 2>& j) const override { run(p, j); }
        double bound() const override {
            if constexpr (requires { mM.bound(); })
                return mM.bound();
            else
                return std::numeric_limits<double>::infinity();
        }

      private:
        template <class T, int Order>
        void run(const PointBatch& points, JetBatch<T, Order>& jets) const {
            if constexpr (PointwiseModel<M>)
                for (int i = 0; i < points.size; ++i) jets.set(i, mM.template at<Order, T>(points[i]));
            else
                mM.template evalBatch<Order, T>(points, jets);
        }
        M mM;
    };

    std::shared_ptr<const detail::FieldModel> mModel;
};

} // namespace curlew
