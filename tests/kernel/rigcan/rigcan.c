// SPDX-License-Identifier: GPL-2.0
/*
 * Two CAN controllers, rigcan0 and rigcan1, on one bus that exists only in memory, below the kernel's whole can-dev
 * state machine (bit timing, error states, bus-off, restart-ms). As on a real bus a frame is repeated until the other
 * port acknowledges it: that port must be up, not bus-off, and at the same bit rate.
 *
 * Faults on request:  echo FAULT > /sys/class/net/rigcan0/fault
 *   warn passive busoff  the error state, with its error frame and counters
 *   noack                nobody acknowledges: error frame, error-passive, the frame waits, the queue fills
 *   txfull               the controller takes no frame: the queue fills, senders see ENOBUFS
 *   rxoverflow           the next received frame is lost, with its error frame
 *   active               none of these (bus-off is left by a restart only); what waited is sent
 */
#include <linux/can/dev.h>
#include <linux/can/error.h>
#include <linux/module.h>
#include <linux/netdevice.h>
#include <linux/spinlock.h>

struct rigcan {
	struct can_priv can;		/* first, as can-dev wants it */
	struct net_device *peer;
	struct can_frame pending;	/* in the controller, not acknowledged */
	bool waiting;
	bool noack, txfull, rxoverflow;
};

static struct net_device *ports[2];
static DEFINE_SPINLOCK(bus);

static const struct can_bittiming_const timing = {
	.name = "rigcan",
	.tseg1_min = 1, .tseg1_max = 16,
	.tseg2_min = 1, .tseg2_max = 8,
	.sjw_max = 4,
	.brp_min = 1, .brp_max = 64, .brp_inc = 1,
};

static int rigcan_get_berr_counter(const struct net_device *dev, struct can_berr_counter *count)
{
	const struct rigcan *p = netdev_priv(dev);

	count->txerr = p->can.state == CAN_STATE_ERROR_WARNING ? 96 :
		       p->can.state == CAN_STATE_ERROR_PASSIVE ? 128 :
		       p->can.state == CAN_STATE_BUS_OFF ? 255 : 0;
	count->rxerr = 0;
	return 0;
}

/* To an error state, with the error frame that tells of it. */
static void rigcan_become(struct net_device *dev, enum can_state state)
{
	struct rigcan *p = netdev_priv(dev);
	struct can_berr_counter count;
	struct can_frame *cf = NULL;
	struct sk_buff *skb;

	if (p->can.state == state)
		return;
	skb = alloc_can_err_skb(dev, &cf);
	can_change_state(dev, cf, state, state);
	if (state == CAN_STATE_BUS_OFF)
		can_bus_off(dev);
	if (!skb)
		return;
	rigcan_get_berr_counter(dev, &count);
	cf->can_id |= CAN_ERR_CNT;
	cf->data[6] = count.txerr;
	cf->data[7] = count.rxerr;
	netif_rx(skb);
}

static void rigcan_report(struct net_device *dev, canid_t class, u8 controller)
{
	struct can_frame *cf;
	struct sk_buff *skb = alloc_can_err_skb(dev, &cf);

	if (!skb)
		return;
	cf->can_id |= class;
	cf->data[1] = controller;
	netif_rx(skb);
}

static void rigcan_receive(struct net_device *dev, const struct can_frame *frame)
{
	struct rigcan *p = netdev_priv(dev);
	struct can_frame *cf;
	struct sk_buff *skb;

	if (p->rxoverflow) {
		p->rxoverflow = false;
		dev->stats.rx_over_errors++;
		dev->stats.rx_errors++;
		rigcan_report(dev, CAN_ERR_CRTL, CAN_ERR_CRTL_RX_OVERFLOW);
		return;
	}
	skb = alloc_can_skb(dev, &cf);
	if (!skb)
		return;
	*cf = *frame;
	dev->stats.rx_packets++;
	dev->stats.rx_bytes += frame->len;
	netif_rx(skb);
}

static bool rigcan_listens(struct net_device *dev, u32 bitrate)
{
	const struct rigcan *p = netdev_priv(dev);

	return netif_running(dev) && p->can.state < CAN_STATE_BUS_OFF && p->can.bittiming.bitrate == bitrate;
}

/* Puts the pending frame on the bus; keeps it if nobody acknowledges. */
static void rigcan_send(struct net_device *dev)
{
	struct rigcan *p = netdev_priv(dev);
	bool acknowledged = (p->can.ctrlmode & CAN_CTRLMODE_LOOPBACK) ||
			    (!p->noack && rigcan_listens(p->peer, p->can.bittiming.bitrate));

	p->waiting = !acknowledged;
	if (acknowledged) {
		if (!(p->can.ctrlmode & CAN_CTRLMODE_LOOPBACK))
			rigcan_receive(p->peer, &p->pending);
		dev->stats.tx_packets++;
		dev->stats.tx_bytes += can_get_echo_skb(dev, 0, NULL);
	} else {
		rigcan_report(dev, CAN_ERR_ACK, 0);
		if (p->can.state < CAN_STATE_ERROR_PASSIVE)
			rigcan_become(dev, CAN_STATE_ERROR_PASSIVE);
		if (p->can.ctrlmode & CAN_CTRLMODE_ONE_SHOT) {
			can_free_echo_skb(dev, 0, NULL);
			dev->stats.tx_aborted_errors++;
			p->waiting = false;
		}
	}
	if (p->waiting || p->txfull)
		netif_stop_queue(dev);
	else
		netif_wake_queue(dev);
}

/* The bus has changed: a frame that waits may be acknowledged now. */
static void rigcan_repeat(struct net_device *dev)
{
	struct rigcan *p = netdev_priv(dev);

	if (!netif_running(dev) || !p->waiting || p->can.state >= CAN_STATE_BUS_OFF || p->noack ||
	    !rigcan_listens(p->peer, p->can.bittiming.bitrate))
		return;
	rigcan_become(dev, CAN_STATE_ERROR_ACTIVE);
	rigcan_send(dev);
}

static netdev_tx_t rigcan_xmit(struct sk_buff *skb, struct net_device *dev)
{
	struct rigcan *p = netdev_priv(dev);

	if (can_dev_dropped_skb(dev, skb))
		return NETDEV_TX_OK;
	spin_lock_bh(&bus);
	p->pending = *(struct can_frame *)skb->data;
	can_put_echo_skb(skb, dev, 0, 0);
	rigcan_send(dev);
	spin_unlock_bh(&bus);
	return NETDEV_TX_OK;
}

/* On opening, and by can-dev after bus-off. */
static int rigcan_set_mode(struct net_device *dev, enum can_mode mode)
{
	struct rigcan *p = netdev_priv(dev);

	if (mode != CAN_MODE_START)
		return -EOPNOTSUPP;
	spin_lock_bh(&bus);
	p->can.state = CAN_STATE_ERROR_ACTIVE;
	p->waiting = false;
	if (!p->txfull)
		netif_wake_queue(dev);
	rigcan_repeat(p->peer);
	spin_unlock_bh(&bus);
	return 0;
}

static int rigcan_open(struct net_device *dev)
{
	struct rigcan *p = netdev_priv(dev);
	int err = open_candev(dev);

	if (err)
		return err;
	p->noack = p->txfull = p->rxoverflow = false;
	return rigcan_set_mode(dev, CAN_MODE_START);
}

static int rigcan_stop(struct net_device *dev)
{
	struct rigcan *p = netdev_priv(dev);

	netif_stop_queue(dev);
	spin_lock_bh(&bus);
	p->can.state = CAN_STATE_STOPPED;
	p->waiting = false;
	spin_unlock_bh(&bus);
	close_candev(dev);
	return 0;
}

static void rigcan_no_fault(struct net_device *dev)
{
	struct rigcan *p = netdev_priv(dev);

	p->noack = p->txfull = p->rxoverflow = false;
	if (p->can.state >= CAN_STATE_BUS_OFF)
		return;
	rigcan_repeat(dev);
	rigcan_become(dev, CAN_STATE_ERROR_ACTIVE);
	if (!p->waiting)
		netif_wake_queue(dev);
}

static ssize_t fault_store(struct device *device, struct device_attribute *attribute, const char *text, size_t size)
{
	enum { ACTIVE, WARN, PASSIVE, BUSOFF, NOACK, TXFULL, RXOVERFLOW };
	static const char *const names[] = { "active", "warn", "passive", "busoff", "noack", "txfull", "rxoverflow" };
	struct net_device *dev = to_net_dev(device);
	struct rigcan *p = netdev_priv(dev);
	int fault = sysfs_match_string(names, text);

	if (fault < 0)
		return fault;
	if (!netif_running(dev))
		return -ENETDOWN;
	spin_lock_bh(&bus);
	switch (fault) {
	case ACTIVE:
		rigcan_no_fault(dev);
		break;
	case WARN:
		rigcan_become(dev, CAN_STATE_ERROR_WARNING);
		break;
	case PASSIVE:
		rigcan_become(dev, CAN_STATE_ERROR_PASSIVE);
		break;
	case BUSOFF:
		rigcan_become(dev, CAN_STATE_BUS_OFF);
		break;
	case NOACK:
		p->noack = true;
		break;
	case TXFULL:
		p->txfull = true;
		netif_stop_queue(dev);
		break;
	case RXOVERFLOW:
		p->rxoverflow = true;
		break;
	}
	spin_unlock_bh(&bus);
	return size;
}
static DEVICE_ATTR_WO(fault);

static struct attribute *attributes[] = { &dev_attr_fault.attr, NULL };
static const struct attribute_group group = { .attrs = attributes };

static const struct net_device_ops operations = {
	.ndo_open = rigcan_open,
	.ndo_stop = rigcan_stop,
	.ndo_start_xmit = rigcan_xmit,
	.ndo_change_mtu = can_change_mtu,
};

static struct net_device *rigcan_make(void)
{
	struct net_device *dev = alloc_candev(sizeof(struct rigcan), 1);
	struct rigcan *p;

	if (!dev)
		return NULL;
	strscpy(dev->name, "rigcan%d", IFNAMSIZ);
	dev->netdev_ops = &operations;
	dev->flags |= IFF_ECHO;
	dev->sysfs_groups[0] = &group;
	p = netdev_priv(dev);
	p->can.clock.freq = 8000000;
	p->can.bittiming_const = &timing;
	p->can.do_set_mode = rigcan_set_mode;
	p->can.do_get_berr_counter = rigcan_get_berr_counter;
	p->can.ctrlmode_supported = CAN_CTRLMODE_LOOPBACK | CAN_CTRLMODE_BERR_REPORTING | CAN_CTRLMODE_ONE_SHOT;
	return dev;
}

static void rigcan_remove(void)
{
	int i;

	for (i = 0; i < 2; i++)
		if (ports[i] && ports[i]->reg_state == NETREG_REGISTERED)
			unregister_candev(ports[i]);
	for (i = 0; i < 2; i++)
		if (ports[i])
			free_candev(ports[i]);
}

static int __init rigcan_init(void)
{
	int i, err = 0;

	for (i = 0; i < 2; i++) {
		ports[i] = rigcan_make();
		if (!ports[i]) {
			rigcan_remove();
			return -ENOMEM;
		}
	}
	for (i = 0; i < 2 && !err; i++) {
		((struct rigcan *)netdev_priv(ports[i]))->peer = ports[!i];
		((struct rigcan *)netdev_priv(ports[!i]))->peer = ports[i];
		err = register_candev(ports[i]);
	}
	if (err)
		rigcan_remove();
	return err;
}

module_init(rigcan_init);
module_exit(rigcan_remove);
MODULE_LICENSE("GPL");
MODULE_DESCRIPTION("two CAN controllers on one in-memory bus, with faults on request");
