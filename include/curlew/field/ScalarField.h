// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "curlew/base/Error.h"
#include "curlew/field/PointLattice.h"
#include "curlew/math/Dispatch.h"
#include "curlew/math/Interval.h"
#include "curlew/math/Symbol.h"

#include <concepts>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace curlew {

/// Computes the jets at a batch of a lattice.
template <class T, int Order>
using OnLattice = std::function<void(const LatticeBatch& batch, JetBatch<T, Order>& jets)>;

/// What fields have prepared for a lattice, so that others can share it. Keeps their models. Not for several threads at
/// a time.
class LatticeMemo {
  public:
    /// Returns what the field with this model has prepared; empty if nothing.
    template <class T, int Order>
    OnLattice<T, Order> find(const void* model) const {
        for (const auto& [of, prepared] : std::get<Known<T, Order>>(mKnown))
            if (of.get() == model) return prepared;
        return {};
    }
    template <class T, int Order>
    void add(std::shared_ptr<const void> model, const OnLattice<T, Order>& prepared) {
        std::get<Known<T, Order>>(mKnown).emplace_back(std::move(model), prepared);
    }

  private:
    template <class T, int Order>
    using Known = std::vector<std::pair<std::shared_ptr<const void>, OnLattice<T, Order>>>;
    std::tuple<Known<float, 1>, Known<double, 0>> mKnown;
};

namespace detail {

/// The implementation of a field: one virtual call per batch, for each precision and order of derivatives.
template <int N>
class FieldModel {
  public:
    virtual ~FieldModel() = default;
    virtual void eval(const PointBatchN<N>&, JetBatchN<float, N, 0>&) const = 0;
    virtual void eval(const PointBatchN<N>&, JetBatchN<float, N, 1>&) const = 0;
    virtual void eval(const PointBatchN<N>&, JetBatchN<double, N, 0>&) const = 0;
    virtual void eval(const PointBatchN<N>&, JetBatchN<double, N, 1>&) const = 0;
    virtual void eval(const PointBatchN<N>&, JetBatchN<double, N, 2>&) const = 0;
    virtual void eval(const PointBatchN<N>&, JetBatchN<double, N, 3>&) const = 0;
    /// Returns whether the function is worth keeping for others, because it was more work than to make it again.
    virtual bool prepare(const PointLattice&, OnLattice<float, 1>&) const = 0;
    virtual bool prepare(const PointLattice&, OnLattice<double, 0>&) const = 0;
    virtual Interval range() const = 0;
    virtual double wavelength() const = 0;
    virtual bool homogeneous() const = 0;
    virtual void record(SymbolModule&, const Vec<Symbol<double>, N>&, Jet<Symbol<float>, N, 1>&) const = 0;
    virtual void record(SymbolModule&, const Vec<Symbol<double>, N>&, Jet<Symbol<float>, N, 2>&) const = 0;
};

} // namespace detail

/// A model whose jets are computed position by position: `model.at<Order, T>(position)`.
template <class M, int N>
concept PointwiseModel = requires(const M& m, const Vec<double, N>& p) {
    { m.template at<2, double>(p) } -> std::same_as<Jet<double, N, 2>>;
};

/// A pointwise model whose jets can be recorded: it is a template on the type of the position.
template <class M, int N>
concept SymbolicModel = requires(const M& m, const Vec<Symbol<double>, N>& p) {
    { m.template at<1, Symbol<float>>(p) } -> std::same_as<Jet<Symbol<float>, N, 1>>;
};

/// A model made of other fields whose jets can be recorded: `model.symbols<Order>(module, position)` calls
/// `symbols<Order>(module, …)` of these fields.
template <class M, int N>
concept ComposedModel = requires(const M& m, SymbolModule& module, const Vec<Symbol<double>, N>& p) {
    { m.template symbols<1>(module, p) } -> std::same_as<Jet<Symbol<float>, N, 1>>;
};

/// A model that is instantiated for the lanes of every instruction set (field/Kernels.h).
template <class M>
concept LaneModel = requires {
    requires M::kHasKernels;
};

/// Evaluates a model with numbers T.
template <int Order>
struct ModelKernel {
    template <class T, class M, int N>
    static void run(const M& model, const PointBatchN<N>& points, JetBatchN<NumberOf<T>, N, Order>& jets) {
        if constexpr (PointwiseModel<M, N>)
            for (int i = 0; i < points.size; i += kLanes<T>)
                jets.set(i, model.template at<Order, T>(points.template lanes<Rebind<T, double>>(i)));
        else
            model.template evalBatch<Order, T>(points, jets);
    }
};

/// A scalar function of position in N dimensions with exact derivatives. It is a cheap handle to an immutable model,
/// which copies share. Evaluation is safe from any number of threads.
///
/// T is the precision of values and derivatives (float or double). Order is the highest derivative: up to 1 in float, 3
/// in double. Positions are always double.
template <int N>
class ScalarFieldN {
  public:
    static constexpr int kDimension = N;

    /// Creates a field from a model M. M is pointwise (above) or has
    /// `template <int Order, class T> void evalBatch(const PointBatchN<N>&, JetBatchN<T, N, Order>&) const`.
    /// It may have `Interval range() const`, `double wavelength() const`, `bool homogeneous() const` and kernels
    /// (above). With kernels, T may be lanes, and the batch is then a JetBatchN<NumberOf<T>, N, Order>. It may have
    /// `template <int Order, class T> OnLattice<T, Order> onLattice(const PointLattice&) const`, which computes the
    /// same bits on a lattice faster than batch by batch, or returns an empty function where it is no faster. Models
    /// that satisfy one of the concepts of symbols above can be written as a shader.
    template <class M>
    requires(!std::same_as<std::remove_cvref_t<M>, ScalarFieldN>) explicit ScalarFieldN(M model)
        : mModel(std::make_shared<const Model<M>>(std::move(model))) {}

    template <class T, int Order>
    void eval(const PointBatchN<N>& points, JetBatchN<T, N, Order>& jets) const {
        mModel->eval(points, jets);
    }

    /// Returns a function that computes the jets at batches of a lattice: the same bits as eval(). What several batches
    /// share is computed once, at this call; for all users of the lattice's memo, if it has one. Any lattice with the
    /// same coordinates will do for the batches. The function refers to the field. T and Order are float and 1,
    /// or double and 0.
    template <class T, int Order>
    OnLattice<T, Order> onLattice(const PointLattice& lattice) const requires(N == 3) {
        OnLattice<T, Order> prepared;
        if (lattice.memo) prepared = lattice.memo->find<T, Order>(mModel.get());
        if (prepared) return prepared;
        const bool worthKeeping = mModel->prepare(lattice, prepared);
        if (lattice.memo && worthKeeping) lattice.memo->add(mModel, prepared);
        return prepared;
    }

    /// Returns the jet at one position. Batches are faster for many positions.
    template <int Order, class T = double>
    Jet<T, N, Order> at(const Vec<double, N>& position) const {
        PointBatchN<N> points;
        points.push(position);
        JetBatchN<T, N, Order> jets;
        eval(points, jets);
        return jets[0];
    }

    /// Records a call of this field, which is a function of the module, and returns its jet. Order is 1 or 2. Throws
    /// ValueError if a part of the field cannot be recorded.
    template <int Order>
    Jet<Symbol<float>, N, Order> symbols(SymbolModule& module, const Vec<Symbol<double>, N>& position) const {
        const auto take = [](const SymbolModule::Symbols& from, auto& to) {
            const AnySymbol* next = from.data();
            detail::take(next, to);
        };
        const std::vector types(size_t{N}, SymbolType::wide);
        const size_t function =
            module.recordOnce(mModel, Order, "field", types, [&](const SymbolModule::Symbols& parameters) {
                Vec<Symbol<double>, N> p;
                take(parameters, p);
                Jet<Symbol<float>, N, Order> jet;
                mModel->record(module, p, jet);
                SymbolModule::Symbols results;
                detail::append(results, jet);
                return results;
            });
        SymbolModule::Symbols arguments;
        detail::append(arguments, position);
        Jet<Symbol<float>, N, Order> jet;
        take(module.call(function, arguments), jet);
        return jet;
    }

    /// Returns an interval that contains all values; unbounded if none is known.
    Interval range() const { return mModel->range(); }

    /// Returns the longest wavelength (cell of the lowest octave) of the noises in the field, in world units; 0 if none
    /// is known.
    double wavelength() const { return mModel->wavelength(); }

    /// Returns whether the field is known to be smooth and to have derivatives of much the same size everywhere, so
    /// that random places show their largest values. Noises without billow and warp, ramps, and sums and affine maps of
    /// these are.
    bool homogeneous() const { return mModel->homogeneous(); }

  private:
    template <class M>
    class Model final : public detail::FieldModel<N> {
      public:
        explicit Model(M model) : mM(std::move(model)) {}
        void eval(const PointBatchN<N>& p, JetBatchN<float, N, 0>& j) const override { run(p, j); }
        void eval(const PointBatchN<N>& p, JetBatchN<float, N, 1>& j) const override { run(p, j); }
        void eval(const PointBatchN<N>& p, JetBatchN<double, N, 0>& j) const override { run(p, j); }
        void eval(const PointBatchN<N>& p, JetBatchN<double, N, 1>& j) const override { run(p, j); }
        void eval(const PointBatchN<N>& p, JetBatchN<double, N, 2>& j) const override { run(p, j); }
        void eval(const PointBatchN<N>& p, JetBatchN<double, N, 3>& j) const override { run(p, j); }
        bool prepare(const PointLattice& l, OnLattice<float, 1>& p) const override { return prepareOn(l, p); }
        bool prepare(const PointLattice& l, OnLattice<double, 0>& p) const override { return prepareOn(l, p); }
        void record(SymbolModule& m, const Vec<Symbol<double>, N>& p, Jet<Symbol<float>, N, 1>& j) const override {
            recordTo(m, p, j);
        }
        void record(SymbolModule& m, const Vec<Symbol<double>, N>& p, Jet<Symbol<float>, N, 2>& j) const override {
            recordTo(m, p, j);
        }
        Interval range() const override {
            if constexpr (requires { mM.range(); })
                return mM.range();
            else
                return {};
        }
        double wavelength() const override {
            if constexpr (requires { mM.wavelength(); })
                return mM.wavelength();
            else
                return 0;
        }
        bool homogeneous() const override {
            if constexpr (requires { mM.homogeneous(); })
                return mM.homogeneous();
            else
                return false;
        }

      private:
        template <class T, int Order>
        void run(const PointBatchN<N>& points, JetBatchN<T, N, Order>& jets) const {
            if constexpr (LaneModel<M> && Order <= 2)
                runKernel<ModelKernel<Order>, T>(mM, points, jets);
            else
                ModelKernel<Order>::template run<T>(mM, points, jets);
        }
        template <class T, int Order>
        bool prepareOn(const PointLattice& lattice, OnLattice<T, Order>& prepared) const {
            if constexpr (N == 3) {
                if constexpr (requires { mM.template onLattice<Order, T>(lattice); })
                    prepared = mM.template onLattice<Order, T>(lattice);
                if (prepared) return true;
                prepared = [this](const LatticeBatch& batch, JetBatch<T, Order>& jets) { run(batch.points(), jets); };
            }
            return false;
        }
        template <int Order>
        void recordTo(SymbolModule& module, const Vec<Symbol<double>, N>& p, Jet<Symbol<float>, N, Order>& jet) const {
            if constexpr (ComposedModel<M, N>)
                jet = mM.template symbols<Order>(module, p);
            else if constexpr (SymbolicModel<M, N>)
                jet = mM.template at<Order, Symbol<float>>(p);
            else if constexpr (requires { M::kNotSymbolic; })
                throw ValueError(std::string(M::kNotSymbolic) + " cannot be written as a shader");
            else
                throw ValueError("a field of this type cannot be written as a shader");
        }
        M mM;
    };

    std::shared_ptr<const detail::FieldModel<N>> mModel;
};
using ScalarField = ScalarFieldN<3>;

} // namespace curlew
